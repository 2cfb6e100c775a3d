//! Clusters from meshes.

use crate::levels::{finest, levels};
use crate::part::Source;
use crate::{ClusterMesh, Error, MeshInput};
use rayon::prelude::*;

/// Makes clusters in all levels of detail, on all threads of the current rayon pool.
///
/// The result only depends on `mesh`, not on the number of threads.
///
/// # Errors
///
/// When the mesh is no mesh; the error names what is wrong.
pub fn build(mesh: &MeshInput) -> Result<ClusterMesh, Error> {
    mesh.check()?;
    Ok(levels(&Source::new(mesh)))
}

/// [`build`] for many meshes, with the result in the same order. Whenever a mesh is done,
/// `progress` is told its number of triangles, on any thread.
///
/// # Errors
///
/// When one of the meshes is no mesh: an [`Error::Mesh`] that names it.
pub fn build_all(
    meshes: &[MeshInput],
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Vec<ClusterMesh>, Error> {
    each(meshes, progress, levels)
}

/// The clusters of many meshes without coarser levels of detail, which takes a small part of the
/// time. All triangles are drawn from them, but only where they are seen.
///
/// # Errors
///
/// As for [`build_all`].
pub fn build_finest(meshes: &[MeshInput]) -> Result<Vec<ClusterMesh>, Error> {
    each(meshes, &|_| {}, finest)
}

fn each(
    meshes: &[MeshInput],
    progress: &(dyn Fn(u64) + Sync),
    clusters_of: fn(&Source) -> ClusterMesh,
) -> Result<Vec<ClusterMesh>, Error> {
    for (i, mesh) in meshes.iter().enumerate() {
        mesh.check().map_err(|error| Error::Mesh { mesh: i, error: Box::new(error) })?;
    }
    // Large meshes first, so that no thread begins one when the others have nothing left to do.
    let mut order: Vec<usize> = (0..meshes.len()).collect();
    order.sort_by_key(|&i| std::cmp::Reverse(meshes[i].triangles.len()));
    let mut built: Vec<(usize, ClusterMesh)> = order
        .into_iter()
        // The next mesh goes to whichever thread is free; `par_iter` would not keep the order.
        .par_bridge()
        .map(|i| {
            let clusters = clusters_of(&Source::new(&meshes[i]));
            progress(meshes[i].triangles.len() as u64);
            (i, clusters)
        })
        .collect();
    built.sort_by_key(|&(i, _)| i);
    Ok(built.into_iter().map(|(_, clusters)| clusters).collect())
}
