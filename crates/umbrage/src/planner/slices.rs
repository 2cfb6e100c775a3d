//! The maps of one part of the view, one for each slice.

use super::{Draft, Planner, Request};
use crate::bounds::Plane;
use crate::casters::caster_planes;
use crate::focus::Body;
use crate::light::Projector;
use crate::math::range;
use crate::partition::{self, Along};
use crate::plan::{Face, Part};
use crate::stable::Stable;
use crate::technique::{Cover, Partition, Warp};
use crate::warp::{LightSpace, Precision};

/// Buffers kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Slicing {
    /// A slice on trial.
    draft: Draft,
}

/// How one part of the view is sliced.
struct Slices<'a> {
    part: Part,
    along: &'a Along,
    partition: Partition,
    warp: Warp,
    /// Where slices begin and end, metres along the view.
    ends: partition::Ends,
}

impl Planner {
    /// Appends the maps of all slices of the part whose receivers are `self.bodies.face`.
    pub(super) fn draft_slices(&mut self, part: Part, along: &Along, request: &Request<'_>) {
        let technique = request.technique;
        let (mut partition, mut warp) = (technique.partition, technique.warp);
        if request.camera.is_orthographic() {
            let is_parallel = matches!(request.projector, Projector::Directional { .. });
            warp = warp.without_perspective(is_parallel);
        }
        if part.face == Some(Face::Near) {
            // All pixels on the near face have the same width, so it needs neither slices nor a
            // warp.
            partition.slices = 1;
            if !matches!(warp, Warp::Adaptive(_)) {
                warp = Warp::Uniform;
            }
        }
        let ends = self.slice_ends(&partition, along, warp, request);
        let slices = Slices { part, along, partition, warp, ends };
        for slice in 0..partition.slices as usize {
            self.draft_slice(slice, &slices, request);
        }
    }

    /// The ends of a part's slices.
    fn slice_ends(
        &mut self,
        partition: &Partition,
        along: &Along,
        warp: Warp,
        request: &Request<'_>,
    ) -> partition::Ends {
        let Request { camera, technique, .. } = *request;
        let (body, Slicing { draft }) = (&self.bodies.face, &mut self.slicing);
        let [n, f] = if technique.cover == Cover::Stable || body.is_empty() {
            [camera.near(), camera.far()]
        } else {
            let depths = body.vertices().iter().map(|&v| along.depth_of(v, camera));
            range(depths.map(|d| d.clamp(camera.near(), camera.far()))).into()
        };
        partition::split(partition, [n, f], camera, |from, to| {
            let begin = (from > n).then(|| along.plane_at(from, camera)).flatten();
            let end = (to < f).then(|| along.plane_at(to, camera)).flatten().map(Plane::flipped);
            clip_between(&mut draft.body, body, [begin, end]);
            if matches!(warp, Warp::Psm | Warp::Log) {
                draft.map.clear(camera);
                let [s, t] = self.drafting.draft(draft, along, warp, request);
                return s * t;
            }
            self.drafting.storage(draft, along, warp, request)
        })
    }

    /// Appends the map of one slice.
    fn draft_slice(&mut self, slice: usize, slices: &Slices<'_>, request: &Request<'_>) {
        let Slices { part, along, partition, warp, ends } = slices;
        let Request { camera, technique, .. } = *request;
        let index = self.units.len();
        if self.drafts.len() == index {
            self.drafts.push(Draft::default());
        }
        let draft = &mut self.drafts[index];
        draft.is_kept = false;
        let map = &mut draft.map;
        map.clear(camera);
        map.part = Part { slice, ..*part };
        let split = [ends[slice], ends[slice + 1]];
        map.split = split;
        let is_last = slice + 1 == partition.slices as usize;
        let overlap = if is_last { 0.0 } else { partition.overlap };
        let reach = split[1] + overlap * (split[1] - split[0]).max(0.0);
        let before = |depth| along.plane_at(depth, camera).map(Plane::flipped);
        // The first slice begins and the last one ends with the receivers, without planes of their
        // own.
        let end = before(reach).filter(|_| !is_last);
        let begin = along.plane_at(split[0], camera).filter(|_| slice > 0);
        clip_between(&mut draft.body, &self.bodies.face, [begin, end]);
        map.fade_from = before(split[1]).filter(|_| overlap > 0.0);
        map.cell.extend(end.into_iter().chain(begin));
        map.cell.extend_from_slice(&self.cell);
        map.cell.push(Plane { normal: -camera.forward(), offset: camera.far() });
        draft.stable = (technique.cover == Cover::Stable).then(|| {
            let range = [split[0], reach].map(|d| d.clamp(camera.near(), camera.far()));
            Stable::around(request.projector, camera, range)
        });
        (draft.shape, draft.largest_errors) = (None, None);
        let space = LightSpace::fixed(request.projector, camera);
        let unit = match draft.stable {
            None => self.drafting.draft(draft, along, *warp, request),
            Some(stable) => {
                draft.bounds = draft.body.bounds();
                draft.see(&space, camera, Precision::Final);
                // A slice outside the view's range of distances never serves any receiver.
                let is_outside = split[0] >= camera.far() || reach <= camera.near();
                if is_outside { [0.0; 2] } else { stable.unit_errors() }
            }
        };
        self.units.push(unit);
        let Draft { map, body, bounds, outline, .. } = draft;
        let around = self.around.iter().chain(&map.cell).copied();
        caster_planes(&mut map.caster_planes, around, body, *bounds, &space, outline);
    }
}

/// Sets `slice` to the part of a body between planes, of which none, one or both are given.
fn clip_between(slice: &mut Body, body: &Body, planes: [Option<Plane>; 2]) {
    match planes {
        [Some(begin), Some(end)] => slice.set_clipped(body, &[begin, end]),
        [Some(plane), None] | [None, Some(plane)] => slice.set_clipped(body, &[plane]),
        [None, None] => slice.set_clipped(body, &[]),
    }
}
