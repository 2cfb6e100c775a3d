//! Recipes for what a renderer needs beyond the tutorial (the example `renderer`). Each is a file
//! in the folder `cookbook` of this crate, and a test runs each of them against known shadows.
//!
//! | you want | recipe |
//! | --- | --- |
//! | to draw skinned, displaced or procedural casters | [`custom_casters`] |
//! | to shade from depth and a G-buffer's normals | [`deferred`] |
//! | surfaces with smooth normals not to shadow themselves | [`smooth_normals`] |
//! | several cameras at once | [`two_cameras`] |
//! | to change the technique or its filter at run time | [`filter_at_run_time`] |
//! | to see which map serves a point, and the map itself | [`show_a_map`] |
//! | a filter for the sun and another for lamps | [`filters_per_light`] |
//! | maps fitted to what the camera sees | [`fit_to_seen`] |
//! | to follow the size of a window | [`resizing`] |
//! | models of millions of triangles, at a cost that follows texels | [`huge_models`] |
//! | shadows that stand still, with a bound on every texel's width | [`pages`] |
//!
//! # Hidden fragments
//!
//! Shadow lookups run once for each fragment that is shaded, and a fragment that something hides
//! later was shaded in vain. Two habits avoid most of this:
//!
//! - Draw opaque models with a pipeline whose fragment stage does not `discard`. A stage that may
//!   discard keeps the device from testing depth before it shades, so that hidden fragments are
//!   shaded too. Keep such a stage for models with holes.
//! - Draw the nearest models first, by the farthest corner of each model's box: ground and walls
//!   then follow what stands before them. Models that are about equally far away can be sorted by
//!   mesh and share a draw.
//!
//! In eight scenes, together they leave 0.23 to 0.72 of the fragments: 0.45 in a race track, 0.23
//! in a forest of opaque leaves, 0.65 among 25 dragons. Without `discard` but in the order of the
//! meshes, 0.33 to 0.96 are left. A pass that draws depth ahead of the shading does not pay: it
//! draws all vertices a second time, which costs more than the few fragments that it hides.

/// A pipeline of your own draws casters with any vertex shader: its vertex stage returns
/// `shadow_caster` of the position in render space. One text is right on every device, whether the
/// device clamps depths or not.
///
/// The boxes that you cull by (`MapPass::may_cast`) and tell of (`Casters::MovedIn`) must hold the
/// vertices where the shader puts them, not where the mesh has them.
///
#[doc = "```"]
#[doc = include_str!("../cookbook/custom_casters.rs")]
#[doc = "```"]
///
/// `skinned.wgsl`:
///
#[doc = "```wgsl"]
#[doc = include_str!("../cookbook/skinned.wgsl")]
#[doc = "```"]
pub mod custom_casters {}

/// Deferred shading looks shadows up by the position that follows from the viewer's depths and by
/// the G-buffer's normal. Keep the triangles' own normals there, or see [`smooth_normals`].
///
/// Far from the world's origin make `render_from_clip` and `Frame::render_origin` relative to the
/// eye. Positions then keep their digits.
///
#[doc = "```"]
#[doc = include_str!("../cookbook/deferred.rs")]
#[doc = "```"]
///
/// `deferred.wgsl`:
///
#[doc = "```wgsl"]
#[doc = include_str!("../cookbook/deferred.wgsl")]
#[doc = "```"]
pub mod deferred {}

/// An interpolated normal leans off its triangle's plane. The lookup then expects depths beside the
/// point that the triangle does not have, and facets shadow themselves where the filter is wide. In
/// the test's scene, a dome of facets 17 degrees apart under `pcf7`, more than one pixel in a
/// hundred of the lit dome is dark; with the triangles' own normals, and with the tolerant lookup
/// below, none is.
///
#[doc = "```"]
#[doc = include_str!("../cookbook/smooth_normals.rs")]
#[doc = "```"]
pub mod smooth_normals {}

/// Plans follow the camera, so every view has maps of its own: a planner and
/// [`Shadows`](crate::Shadows) each. Stable cascades (`uniform(stable)+z4`) do not depend on where
/// the camera looks, but on where it is; they are no exception.
///
#[doc = "```"]
#[doc = include_str!("../cookbook/two_cameras.rs")]
#[doc = "```"]
pub mod two_cameras {}

/// A technique can change in every frame. Only its filter is part of the shader.
///
#[doc = "```"]
#[doc = include_str!("../cookbook/filter_at_run_time.rs")]
#[doc = "```"]
pub mod filter_at_run_time {}

/// `shadow_place(light, position)` tells which map serves a point and where in the map the point
/// lies; `Plan::lookup` tells it on the CPU, and `Shadows::place` where a map lies in the depth
/// texture.
///
#[doc = "```"]
#[doc = include_str!("../cookbook/show_a_map.rs")]
#[doc = "```"]
///
/// `show_a_map.wgsl`:
///
#[doc = "```wgsl"]
#[doc = include_str!("../cookbook/show_a_map.wgsl")]
#[doc = "```"]
pub mod show_a_map {}

/// Lights that share a filter share a plan and a budget of texels. A light with another filter has
/// a planner and [`Shadows`](crate::Shadows) of its own, and its lookup's names get a prefix.
///
#[doc = "```"]
#[doc = include_str!("../cookbook/filters_per_light.rs")]
#[doc = "```"]
///
/// `filters_per_light.wgsl`:
///
#[doc = "```wgsl"]
#[doc = include_str!("../cookbook/filters_per_light.wgsl")]
#[doc = "```"]
pub mod filters_per_light {}

/// Texels are saved where shadows end nearer than the picture does. The camera that is planned for
/// ends at that distance.
///
#[doc = "```"]
#[doc = include_str!("../cookbook/shadow_distance.rs")]
#[doc = "```"]
pub mod shadow_distance {}

/// The size of the picture is part of the camera. Nothing of [`Shadows`](crate::Shadows) depends on
/// it.
///
#[doc = "```"]
#[doc = include_str!("../cookbook/resizing.rs")]
#[doc = "```"]
pub mod resizing {}

/// Where walls hide most of the scene, maps fitted to what is seen have several times less error
/// than maps fitted to boxes. The depths of a frame come back one or two frames later, without
/// waiting. What the camera has come to see since then is taken from the boxes:
/// [`SeenTiles`](umbrage::SeenTiles) says what is guaranteed.
///
#[doc = "```"]
#[doc = include_str!("../cookbook/fit_to_seen.rs")]
#[doc = "```"]
pub mod fit_to_seen {}

/// Static models in levels of detail: each map gets as many of their triangles as its texels can
/// tell apart, chosen on the device. Where it lacks what this takes ([`Support::clusters`]), draw
/// with [`MeshCasters`](crate::MeshCasters).
///
/// [`Support::clusters`]: crate::Support::clusters
///
#[doc = "```"]
#[doc = include_str!("../cookbook/huge_models.rs")]
#[doc = "```"]
pub mod huge_models {}

/// [Paged maps](umbrage::paged) are drawn from the viewer's depths, which need a pass ahead of the
/// shading. These have whole meshes as casters, of which those that move are kept apart, and lights
/// that move are looked up where they were a while ago. Clusters are faster for all that is larger
/// than a page: see [`PageClusters`](crate::PageClusters). Where a device has no pages
/// ([`Support::pages`](crate::Support::pages)), take what
/// [`Support::instead_of_pages`](crate::Support::instead_of_pages) gives.
///
#[doc = "```"]
#[doc = include_str!("../cookbook/pages.rs")]
#[doc = "```"]
pub mod pages {}
