use crate::options::{Options, Size};

/// Texels in s and t for a map whose largest errors at one texel and one pixel are `unit_s` and
/// `unit_t`: res_s : res_t = M_s : M_t, so that both errors come out equal (Lloyd et al. 2006, Eqs. 13, 14).
/// Never more texels than the budget; a side that the device cannot have is cut, and the other side gets
/// what it leaves over.
pub(crate) fn resolution(options: &Options, unit_s: f64, unit_t: f64) -> [u32; 2] {
    let budget = match options.size {
        Size::Exact(size) => return size,
        Size::Budget(texels) => texels as f64,
        Size::MaxError(_) => todo!(),
    };
    let ratio = (unit_s / unit_t).clamp(1e-9, 1e9);
    let max = f64::from(options.max_side);
    let s = (budget * ratio).sqrt().clamp(1.0, max);
    // Rounding s first and giving t what is left keeps within the budget and wastes the least.
    let t = (budget / s.round()).floor().clamp(1.0, max);
    let s = (budget / t).floor().clamp(1.0, max).min(if t == max { max } else { s.round() });
    [s as u32, t as u32]
}
