//! Places in a disc that keep a distance from each other.

/// The number of places.
pub(super) const MAX_PLACES: usize = 64;

/// Poisson-disc places in the disc of diameter 1 around 0. Each place is the best of some random
/// candidates: the one farthest from all places before it (Mitchell 1991) and from its own mirror
/// image beyond the rim. The distance to the image counts three times, because otherwise too many
/// places would lie on the rim. The first n places are spread evenly for every n.
pub(super) const PLACES: [[f32; 2]; MAX_PLACES] = places();

/// Number of random candidates for each place.
const CANDIDATES: usize = 24;

const fn places() -> [[f32; 2]; MAX_PLACES] {
    let mut places = [[0f32; 2]; MAX_PLACES];
    let mut seed = 20_261_125u32;
    let mut n = 0;
    while n < MAX_PLACES {
        let mut farthest = -1.0;
        let mut candidate = 0;
        while candidate < CANDIDATES {
            let mut at = [0.0; 2];
            let mut axis = 0;
            while axis < 2 {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                at[axis] = (seed >> 8) as f32 / (1 << 24) as f32 - 0.5;
                axis += 1;
            }
            let square = at[0] * at[0] + at[1] * at[1];
            if square > 0.25 {
                continue;
            }
            candidate += 1;
            let to_image = 3.0 * (1.0 - 2.0 * root(square));
            let mut nearest = to_image * to_image;
            let mut i = 0;
            while i < n {
                let [x, y] = [at[0] - places[i][0], at[1] - places[i][1]];
                let distance = x * x + y * y;
                if distance < nearest {
                    nearest = distance;
                }
                i += 1;
            }
            if nearest > farthest {
                farthest = nearest;
                places[n] = at;
            }
        }
        n += 1;
    }
    places
}

/// The square root of a number of at most 1/4 (`f32::sqrt` is not const).
const fn root(square: f32) -> f32 {
    let mut root = 0.5;
    let mut step = 0;
    while step < 12 {
        root = 0.5 * (root + square / root);
        step += 1;
    }
    root
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_keep_their_distance_and_fill_the_disc() {
        for n in [4, 9, 25, 64] {
            let places = &PLACES[..n];
            let mut mean = [0.0; 2];
            let mut square = 0.0;
            for (i, &[x, y]) in places.iter().enumerate() {
                assert!(x.hypot(y) <= 0.5);
                // Discs of this diameter around n places cover a quarter of the area.
                let least = 0.5 / (n as f32).sqrt();
                for &[u, v] in &places[..i] {
                    assert!((x - u).hypot(y - v) > least, "{n}: {x} {y}, {u} {v}");
                }
                mean[0] += x / n as f32;
                mean[1] += y / n as f32;
                square += (x * x + y * y) / n as f32;
            }
            assert!(mean[0].hypot(mean[1]) < 0.3 / (n as f32).sqrt(), "{n}: {mean:?}");
            // The mean over the disc is 1/8.
            assert!((square - 0.125).abs() < 0.25 / n as f32 + 0.01, "{n}: {square}");
        }
    }
}
