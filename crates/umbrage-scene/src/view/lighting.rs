use super::occupancy::Occupancy;
use super::{THUMBNAIL, thumbnail};
use crate::types::Lens;
use glam::{DQuat, DVec3};
use umbrage::{Light, PointLight, SpotLight};

/// A light for a view, and its score in that view.
pub(super) struct Lighting {
    pub(super) light: Light,
    /// Higher is better; at most about 1.
    pub(super) score: f64,
}

/// Returns `own` with its score or, without one, the sun that suits the view best: a sun at the
/// side of the viewer, which lights most of the visible surfaces and shows many edges of shadows.
/// Its elevation is 45°, or less if the relief is so gentle that a sun at 45° would cast no
/// shadows.
pub(super) fn lighting(
    grid: &Occupancy,
    own: Option<Light>,
    eye: DVec3,
    target: DVec3,
    lens: Lens,
) -> Lighting {
    let seen: Vec<Option<DVec3>> = thumbnail(eye, target, lens)
        .map(|[start, direction]| {
            let sight = grid.look(start, direction)?;
            // The point lies a little before the surface, so that the surface's own cells do not
            // shadow it.
            let back = 1.5 * grid.cell.max_element() / direction.length();
            Some(start + direction * (sight.distance - back).max(0.0))
        })
        .collect();
    // Surfaces this near a spot or point light do not hide it, because it may hang in a cage or
    // under a shade.
    let housing = 3.0 * grid.cell.max_element();
    let reaches = |p: DVec3, lamp: DVec3| {
        let to_lamp = lamp - p;
        let is_beyond = |share: f64| (1.0 - share) * to_lamp.length() < housing;
        grid.look(p, to_lamp).is_none_or(|s| is_beyond(s.distance))
    };
    // The score of a light, and the share of the visible points that are in shadow.
    let judge = |light: &Light| {
        let is_lit = |p: DVec3| match light {
            Light::Directional { direction } => grid.look(p, -*direction).is_none(),
            Light::Spot(SpotLight { position, .. }) | Light::Point(PointLight { position, .. }) => {
                light.reaches(p) && reaches(p, *position)
            }
        };
        let lit: Vec<Option<bool>> = seen.iter().map(|p| p.map(is_lit)).collect();
        let count = lit.iter().flatten().count().max(1) as f64;
        let dark = lit.iter().flatten().filter(|&&l| !l).count() as f64 / count;
        let neighbours = lit.chunks(THUMBNAIL[0] as usize).flat_map(|row| row.windows(2));
        let edges = neighbours.filter(|w| w[0].zip(w[1]).is_some_and(|(a, b)| a != b));
        (2.0 * edges.count() as f64 / count - (dark - 0.4).abs(), dark)
    };
    if let Some(light) = own {
        return Lighting { light, score: judge(&light).0 };
    }
    let forward = target - eye;
    let direction = -towards_sun(forward, 100.0, 45.0);
    let mut best = Lighting { light: Light::Directional { direction }, score: f64::NEG_INFINITY };
    for elevation_deg in [45.0, 25.0, 12.0] {
        let mut most_dark: f64 = 0.0;
        for azimuth_deg in [60.0_f64, 80.0, 100.0, 120.0, 140.0] {
            for side in [1.0, -1.0] {
                let to_sun = towards_sun(forward, azimuth_deg * side, elevation_deg);
                let light = Light::Directional { direction: -to_sun };
                let (score, dark) = judge(&light);
                let score = score - 0.003 * (azimuth_deg - 100.0).abs();
                most_dark = most_dark.max(dark);
                if score > best.score {
                    best = Lighting { light, score };
                }
            }
        }
        if most_dark > 0.02 {
            break;
        }
    }
    best
}

/// Unit vector towards a sun at an angle of `azimuth_deg` to the left of the direction `forward`.
pub(super) fn towards_sun(forward: DVec3, azimuth_deg: f64, elevation_deg: f64) -> DVec3 {
    let (sin, cos) = elevation_deg.to_radians().sin_cos();
    let ahead = forward.with_y(0.0).normalize_or(DVec3::NEG_Z);
    DQuat::from_rotation_y(azimuth_deg.to_radians()) * ahead * cos + DVec3::Y * sin
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lamp_shines_out_of_its_cage() {
        let scene = crate::builtin("lantern", None).unwrap();
        let grid = Occupancy::of(&scene, scene.bounds());
        let view = &scene.cameras[0];
        let Light::Point(flame) = scene.lights[0].light else { panic!("{:?}", scene.lights) };
        let score = |range: f64| {
            let lamp = Light::Point(PointLight { range, ..flame });
            lighting(&grid, Some(lamp), view.eye, view.target, view.lens).score
        };
        // A light whose range reaches no surface leaves everything dark, without any edge of a
        // shadow.
        let dark = score(0.06);
        assert!((dark + 0.6).abs() < 1e-9, "{dark}");
        assert!(score(flame.range) > 0.0, "{}", score(flame.range));
    }
}
