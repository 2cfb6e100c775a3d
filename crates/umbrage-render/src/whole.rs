//! Instances that cast into pages as whole meshes: those that poses deformed, and those with
//! triangles in whose plane a lamp lies.

use crate::instances::EdgeOn;
use crate::renderer::POSITIONS;
use crate::scene::{InPages, Placed, SceneBuffers};
use crate::{Error, Gpu};
use std::collections::HashMap;
use std::ops::Range;
use umbrage::{Aabb, Plan};
use umbrage_wgpu::{
    MeshCasters, MeshKind, PageMesh, PageMeshDraw, PageMeshPart, PageMeshPass, PageMeshes, Shadows,
};
use wgpu::{BindGroup, Device, IndexFormat, VertexBufferLayout};

/// What draws whole meshes into pages.
pub(crate) struct WholeCasters {
    /// Without and with holes.
    casters: [MeshCasters; 2],
    still: List,
    moving: List,
    /// Of the instances that move, the boxes that were drawn last, and the versions of their poses.
    drawn: HashMap<usize, (Aabb, u64)>,
    /// What the list of those that stand still was made for.
    listed: Option<(u64, Vec<EdgeOn>)>,
}

/// Meshes, and what is drawn of them.
pub(crate) struct List {
    meshes: PageMeshes,
    /// The scene's mesh of each draw.
    draws: Vec<usize>,
}

/// More boxes than these are joined, so that finding out what they touch stays cheap.
const MOST_BOXES: usize = 256;

impl WholeCasters {
    pub(crate) fn new(
        device: &Device,
        scene: &SceneBuffers,
        shadows: &Shadows,
    ) -> Result<Self, Error> {
        let all = scene.attribute_layout.clone();
        let uvs = VertexBufferLayout { attributes: &all.attributes[..1], ..all };
        let casters = |kind, buffers: &[Option<VertexBufferLayout<'_>>]| {
            MeshCasters::for_pages(device, shadows, kind, buffers)
        };
        let positions = Some(POSITIONS);
        Ok(Self {
            casters: [
                casters(MeshKind::Opaque, std::slice::from_ref(&positions))?,
                casters(MeshKind::Masked, &[positions, Some(uvs)])?,
            ],
            still: List::new(device, shadows)?,
            moving: List::new(device, shadows)?,
            drawn: HashMap::new(),
            listed: None,
        })
    }

    /// Lists what is drawn for a plan from now on. If `is_all` is true, that is all of the scene,
    /// otherwise what clusters leave out. Adds boxes in which casters that stand still changed, and
    /// those in which others did.
    pub(crate) fn list(
        &mut self,
        scene: &SceneBuffers,
        plan: &Plan,
        edge_on: &[EdgeOn],
        is_all: bool,
        [still, moving]: [&mut Vec<Aabb>; 2],
    ) {
        let placed = scene.placed();
        self.note_moves(&placed, still, moving);
        let is_listed = self
            .listed
            .as_ref()
            .is_some_and(|(version, listed)| *version == placed.version && listed == edge_on);
        if is_listed && edge_on.is_empty() {
            return;
        }
        self.listed = Some((placed.version, edge_on.to_vec()));
        self.still.clear();
        self.moving.clear();
        let lists = |in_pages| match in_pages {
            InPages::Whole => true,
            InPages::AsClusters => is_all,
            InPages::Moving | InPages::Deformed => false,
        };
        self.still.add(scene, &placed, plan, edge_on, lists);
        self.moving.add(scene, &placed, plan, &[], |in_pages| in_pages == InPages::Deformed);
    }

    /// Finds the boxes of what moved since it was drawn last.
    fn note_moves(&mut self, placed: &Placed, still: &mut Vec<Aabb>, moving: &mut Vec<Aabb>) {
        for (k, pose) in placed.poses() {
            let drawable = &placed.instances[k];
            let now = if drawable.role.casts { drawable.bounds } else { Aabb::EMPTY };
            match self.drawn.insert(k, (now, pose.version)) {
                Some((_, version)) if version == pose.version => {}
                Some((before, _)) => moving.extend([before, now]),
                None => {
                    // It was drawn among what stands still, if it was drawn.
                    still.push(pose.rest);
                    moving.push(now);
                }
            }
        }
        moving.retain(|aabb| !aabb.is_empty());
        while moving.len() > MOST_BOXES {
            let joined = |pair: &[Aabb]| pair.iter().fold(Aabb::EMPTY, |a, &b| a.union(b));
            *moving = moving.chunks(2).map(joined).collect();
        }
    }

    /// What draws the lists, and that of those that stand still and that of those that move.
    pub(crate) fn lists(&mut self) -> ([&mut List; 2], &[MeshCasters; 2]) {
        let Self { casters, still, moving, .. } = self;
        ([still, moving], casters)
    }

    /// The triangles that were drawn last, as far as is known, and whether none were left out.
    pub(crate) fn counts(&mut self, gpu: &Gpu) -> (u64, bool) {
        let lists = [&mut self.still, &mut self.moving];
        let counts = lists.map(|list| match list.draws.is_empty() {
            true => (0, true),
            false => {
                let counts = list.meshes.counts(gpu.device());
                (counts.triangles, counts.is_complete)
            }
        });
        (counts[0].0 + counts[1].0, counts[0].1 && counts[1].1)
    }
}

impl List {
    fn new(device: &Device, shadows: &Shadows) -> Result<Self, Error> {
        Ok(Self { meshes: PageMeshes::new(device, shadows)?, draws: Vec::new() })
    }

    fn clear(&mut self) {
        self.meshes.clear();
        self.draws.clear();
    }

    /// Adds the instances that are `listed`, but for triangles that are edge-on to their light.
    fn add(
        &mut self,
        scene: &SceneBuffers,
        placed: &Placed,
        plan: &Plan,
        edge_on: &[EdgeOn],
        listed: impl Fn(InPages) -> bool,
    ) {
        let is_listed = |&k: &usize| placed.instances[k].role.casts && listed(placed.in_pages(k));
        let has_edge_on =
            |k: &usize| edge_on.iter().any(|e| e.instance == placed.instances[*k].instance);
        let all: Vec<usize> = (0..placed.instances.len()).filter(is_listed).collect();
        let (apart, whole): (Vec<usize>, Vec<usize>) = all.into_iter().partition(has_edge_on);
        // Instances of one mesh stand next to each other.
        for same in whole.chunk_by(|&a, &b| placed.instances[a].mesh == placed.instances[b].mesh) {
            let mesh = placed.instances[same[0]].mesh;
            let triangles = 0..scene.meshes[mesh].triangles();
            self.push(scene, placed, mesh, triangles, None, same);
        }
        for k in apart {
            let drawable = &placed.instances[k];
            let all = scene.meshes[drawable.mesh].triangles();
            for light in 0..plan.lights.len() {
                let is_of = |e: &&EdgeOn| e.light == light && e.instance == drawable.instance;
                let mut first = 0;
                for left_out in edge_on.iter().filter(is_of) {
                    let before = first..left_out.triangle;
                    self.push(scene, placed, drawable.mesh, before, Some(light), &[k]);
                    first = left_out.triangle + 1;
                }
                self.push(scene, placed, drawable.mesh, first..all, Some(light), &[k]);
            }
        }
    }

    fn push(
        &mut self,
        scene: &SceneBuffers,
        placed: &Placed,
        mesh: usize,
        triangles: Range<u32>,
        light: Option<usize>,
        instances: &[usize],
    ) {
        if triangles.is_empty() {
            return;
        }
        let range = &scene.meshes[mesh];
        let first = range.indices.start;
        let draw = PageMeshDraw {
            indices: first + 3 * triangles.start..first + 3 * triangles.end,
            base_vertex: range.first_vertex,
            light,
        };
        let instance = |&k: &usize| {
            let drawable = &placed.instances[k];
            PageMesh { world_from_mesh: drawable.world_from_mesh, bounds: drawable.bounds }
        };
        self.meshes.add(draw, instances.iter().map(instance));
        self.draws.push(mesh);
    }
}

/// Draws a list into pages, with the scene's masks, if it is not empty.
pub(crate) fn draw_list<T>(
    list: &mut List,
    scene: &SceneBuffers,
    casters: &[MeshCasters; 2],
    masks: &[Option<BindGroup>],
    act: impl FnOnce(Option<PageMeshPart<'_>>) -> T,
) -> T {
    let List { meshes, draws } = list;
    if draws.is_empty() {
        return act(None);
    }
    let draw = |pass: &mut PageMeshPass<'_, '_>| {
        pass.pass.set_vertex_buffer(0, scene.positions.slice(..));
        pass.pass.set_vertex_buffer(1, scene.attributes.slice(..));
        pass.pass.set_index_buffer(scene.indices.slice(..), IndexFormat::Uint32);
        for (draw, &mesh) in (0..).zip(&*draws) {
            let is_masked = scene.is_masked(mesh);
            pass.pass.set_pipeline(casters[usize::from(is_masked)].pipeline());
            if let Some(mask) = &masks[scene.meshes[mesh].material] {
                pass.pass.set_bind_group(1, mask, &[]);
            }
            pass.draw(draw);
        }
    };
    act(Some(PageMeshPart { meshes, draw: &draw }))
}
