//! How much detail a GPU draws: all triangles, or clusters of them in levels of detail.

use crate::error::{Error, Field};
use crate::executors::Executors;
use crate::folder::check_file;
use crate::progress::Progress;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use umbrage_clusters::{ClusterMesh, MeshInput, build_all, fingerprint, read, write};
use umbrage_scene::{Alpha, Mesh, Scene};

/// What decides how much detail a GPU draws.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum DetailOptions {
    /// Levels of detail for scenes of so many drawn triangles that it pays:
    /// [`DetailOptions::MANY_TRIANGLES`].
    #[default]
    Auto,
    /// All triangles of every scene.
    Full,
    /// Levels of detail for every scene.
    Levels,
    /// Levels of detail from this file, which [`Detail::write`] wrote for the same scene.
    File(PathBuf),
}

impl DetailOptions {
    /// The number of drawn triangles from which levels of detail pay.
    pub const MANY_TRIANGLES: u64 = 1_000_000;
}

/// The levels of detail of a scene, or none, so that all of its triangles are drawn. Truth and
/// reference always see all of them.
#[derive(Clone, Debug, Default)]
pub struct Detail {
    clusters: Option<Vec<ClusterMesh>>,
}

impl Detail {
    /// All triangles.
    pub const FULL: Self = Self { clusters: None };

    /// Makes or reads what the options ask for, if there is a GPU to draw it.
    ///
    /// # Errors
    /// An error if a file cannot be read, is damaged, or was written for another scene, or if
    /// there is no GPU that could draw what it holds.
    pub fn new(
        scene: &Scene,
        executors: &Executors,
        options: &DetailOptions,
        progress: &dyn Progress,
    ) -> Result<Self, Error> {
        let can_draw = executors.gpu().is_some_and(|gpu| gpu.support().clusters);
        let pays = scene.drawn_triangles() >= DetailOptions::MANY_TRIANGLES;
        match options {
            DetailOptions::File(path) if !can_draw => Err(Error::field(
                Field::Clusters,
                format!("{}: needs a GPU: rays see all triangles", path.display()),
            )),
            _ if !can_draw => Ok(Self::FULL),
            DetailOptions::Full => Ok(Self::FULL),
            DetailOptions::Auto if !pays => Ok(Self::FULL),
            DetailOptions::Auto | DetailOptions::Levels => Self::levels(scene, progress),
            DetailOptions::File(path) => Self::read(scene, path),
        }
    }

    /// Makes the levels of detail of a scene.
    ///
    /// # Errors
    /// An error if a mesh is none.
    pub fn levels(scene: &Scene, progress: &dyn Progress) -> Result<Self, Error> {
        progress.stage("making levels of detail");
        progress.rows(scene.stored_triangles());
        let clusters = build_all(&inputs(scene), &|done| progress.advance(done))
            .map_err(|e| Error::field(Field::Scene, e))?;
        Ok(Self { clusters: Some(clusters) })
    }

    /// Reads the levels of detail of a scene.
    ///
    /// # Errors
    /// An error if the file cannot be read, is damaged, or was written for another scene.
    pub fn read(scene: &Scene, path: &Path) -> Result<Self, Error> {
        let wrong = |problem: String| {
            Error::field(Field::Clusters, format!("{}: {problem}", path.display()))
        };
        let told = |e: std::io::Error| wrong(e.to_string());
        let file = File::open(path).map_err(told)?;
        let length = file.metadata().map_err(told)?.len();
        let vertices: Vec<usize> = scene.meshes.iter().map(|m| m.positions.len()).collect();
        let fingerprint = fingerprint(&inputs(scene));
        let clusters = read(&mut BufReader::new(file), length, &fingerprint, &vertices);
        let again = "; write it again with `umbrage prepare`";
        Ok(Self { clusters: Some(clusters.map_err(|e| wrong(format!("{e}{again}")))?) })
    }

    /// Writes the levels of detail of a scene into a file, whole or not at all.
    ///
    /// # Errors
    /// An error if the file cannot be written.
    pub fn write(&self, scene: &Scene, path: &Path) -> Result<(), Error> {
        check_file(path)?;
        let meshes = self.clusters.as_deref().unwrap_or(&[]);
        let fingerprint = fingerprint(&inputs(scene));
        Ok(umbrage_measure::write_file_with(path, |file| {
            write(file, meshes, &fingerprint).map_err(std::io::Error::other)
        })?)
    }

    /// The clusters of each mesh; `None` if all triangles are drawn.
    pub fn clusters(&self) -> Option<&[ClusterMesh]> {
        self.clusters.as_deref()
    }
}

/// The meshes of a scene, as clusters are made of them.
pub(crate) fn inputs<'a>(scene: &'a Scene) -> Vec<MeshInput<'a>> {
    let input = |mesh: &'a Mesh| MeshInput {
        positions: &mesh.positions,
        normals: &mesh.normals,
        uvs: &mesh.uvs,
        triangles: &mesh.triangles,
        is_masked: matches!(scene.materials[mesh.material].alpha, Alpha::Mask { .. }),
    };
    scene.meshes.iter().map(input).collect()
}
