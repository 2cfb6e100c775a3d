//! The program `umbrage`.
fn main() {}
