//! How many texels each map has.

use crate::error::{Error, check};
use crate::technique::{Limits, Size, Technique};

/// The largest ratio of a map's sides.
const MAX_RATIO: f64 = 1e9;

/// Computes the resolutions, texels in s and t, of maps whose largest errors with one texel are
/// `units` (pixels per texel), and pushes them to `sizes` in turn. Maps whose units are zero get no
/// texels.
///
/// With a budget all maps get the same largest error in s and in t. For an error of one, map i
/// needs uᵢ = M_s M_t texels. A budget of S texels is divided among the maps as S uᵢ/Σu, and
/// within a map as res_s : res_t = M_s : M_t (Lloyd et al. 2006, Eqs. 13, 14). A side longer or
/// shorter than the device allows is clamped, and the texels thereby saved go to the map's other
/// side and to the other maps.
///
/// # Errors
/// If a budget is less than the smallest possible size of all maps, or if an error requires sides
/// longer than the device allows.
pub(crate) fn resolutions(
    technique: &Technique,
    limits: Limits,
    units: &[[f64; 2]],
    sizes: &mut Vec<[u32; 2]>,
) -> Result<(), Error> {
    sizes.clear();
    let limits = Sides::new(technique, limits);
    match technique.size {
        Size::Exact(size) => {
            sizes.extend(units.iter().map(|u| if is_empty(u) { [0; 2] } else { size }));
        }
        Size::Budget(texels) => {
            let least = (limits.least as u64).pow(2) * units.len() as u64;
            check(texels >= least, "technique.size", || {
                format!(
                    "a budget of {texels} texels is too small for {} maps, which need at least {least}",
                    units.len()
                )
            })?;
            let error = common_error(&limits, units, texels as f64);
            sizes.extend(units.iter().map(|&unit| {
                if is_empty(&unit) {
                    return [0; 2];
                }
                let [s, t] = limits.sides(unit, error);
                limits.within(s * t, unit)
            }));
        }
        Size::MaxError(error) => {
            for unit in units {
                sizes.push(if is_empty(unit) { [0; 2] } else { limits.at_least(*unit, error)? });
            }
        }
        // The check of the technique leaves this size to pages, which no map is made for.
        Size::Needed => {}
    }
    Ok(())
}

fn is_empty(unit: &[f64; 2]) -> bool {
    unit.contains(&0.0)
}

/// `size` with both sides multiplied by `factor` and rounded up, or an error if the device does not
/// allow it.
pub(crate) fn enlarged(
    technique: &Technique,
    limits: Limits,
    size: [u32; 2],
    factor: f64,
) -> Result<[u32; 2], Error> {
    Sides::new(technique, limits).at_least(size.map(|n| f64::from(n) * factor), 1.0)
}

/// The lengths that a map's sides may have, texels.
struct Sides {
    /// Sides are multiples of this.
    align: f64,
    /// The number of texels of a side that are reserved for moving the map by whole texels.
    spare: f64,
    least: f64,
    most: f64,
}

impl Sides {
    fn new(technique: &Technique, limits: Limits) -> Self {
        let align = f64::from(limits.align);
        let spare = f64::from(technique.cover.spare_texels());
        Self {
            align,
            spare,
            least: ((1.0 + spare) / align).ceil() * align,
            most: (f64::from(limits.max_side) / align).floor() * align,
        }
    }

    /// The sides with which a map's errors are `error`, not rounded but clamped to the limits.
    fn sides(&self, [s, t]: [f64; 2], error: f64) -> [f64; 2] {
        [s, t].map(|unit| (unit / error).clamp(self.least, self.most))
    }

    fn aligned(&self, side: f64) -> f64 {
        ((side / self.align).floor() * self.align).clamp(self.least, self.most)
    }

    /// The best whole sides with at most `texels` texels, of which there are enough for the least
    /// sides.
    fn within(&self, texels: f64, [unit_s, unit_t]: [f64; 2]) -> [u32; 2] {
        let ratio = (unit_s / unit_t).clamp(1.0 / MAX_RATIO, MAX_RATIO);
        let wanted = (texels * ratio).sqrt().min(texels / self.least);
        // Rounding s first and then giving t the remaining texels keeps to the budget and wastes
        // the fewest texels.
        let nearest = self.aligned(wanted + self.align / 2.0);
        let s = if nearest * self.least <= texels { nearest } else { self.aligned(wanted) };
        let t = self.aligned(texels / s);
        let s =
            if t == self.most { self.aligned(texels / t) } else { s.min(self.aligned(texels / t)) };
        [s as u32, t as u32]
    }

    /// The least whole sides with errors of at most `error`.
    fn at_least(&self, unit: [f64; 2], error: f64) -> Result<[u32; 2], Error> {
        let sides = unit.map(|u| {
            let side = u / error + self.spare;
            ((side / self.align).ceil() * self.align).max(self.least)
        });
        check(sides.iter().all(|&n| n <= self.most), "technique.size", || {
            format!(
                "so small an error needs a map of {}x{} texels, and sides end at {}",
                sides[0], sides[1], self.most
            )
        })?;
        Ok(sides.map(|n| n as u32))
    }
}

/// The error that all maps share when `texels` texels are divided among them.
fn common_error(limits: &Sides, units: &[[f64; 2]], texels: f64) -> f64 {
    let used = || units.iter().filter(|u| !is_empty(u));
    let total =
        |error: f64| used().map(|&u| limits.sides(u, error)).map(|[s, t]| s * t).sum::<f64>();
    let unlimited = (used().map(|[s, t]| s * t).sum::<f64>() / texels).sqrt();
    let fits = |error: f64| total(error) <= texels;
    let cuts_nothing = used()
        .all(|u| u.iter().all(|side| (limits.least..=limits.most).contains(&(side / unlimited))));
    if cuts_nothing || used().next().is_none() {
        return unlimited;
    }
    // The number of texels decreases with the error: bracket the solution, then bisect.
    let (mut lo, mut hi) = (unlimited, unlimited);
    while !fits(hi) && hi < unlimited * 1e30 {
        hi *= 4.0;
    }
    while fits(lo) && lo > unlimited * 1e-30 {
        lo /= 4.0;
    }
    for _ in 0..50 {
        let middle = (lo * hi).sqrt();
        if fits(middle) { hi = middle } else { lo = middle }
    }
    hi
}
