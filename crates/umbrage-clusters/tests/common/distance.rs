//! Distances between surfaces, at many points and without the builder's code.

use crate::common::{Random, Shape};
use glam::{DVec2, DVec3};

type Point = [f64; 5];

/// A surface with its texture as a surface in five dimensions.
pub(crate) struct Surface {
    triangles: Vec<[Point; 3]>,
    boxes: Vec<(Point, Point)>,
}

/// Metres per unit of texture coordinates.
pub(crate) fn metres_per_uv(shape: &Shape) -> f64 {
    if !shape.is_masked {
        return 0.0;
    }
    let (mut space, mut texture) = (0.0f64, 0.0);
    for t in &shape.triangles {
        let [a, b, c] = t.map(|i| shape.positions[i as usize].as_dvec3());
        let [p, q, r] = t.map(|i| shape.uvs[i as usize].as_dvec2());
        space += (b - a).cross(c - a).length();
        texture += (q - p).perp_dot(r - p).abs();
    }
    (space / texture).sqrt()
}

fn sub(a: &Point, b: &Point) -> Point {
    std::array::from_fn(|i| a[i] - b[i])
}

fn dot(a: &Point, b: &Point) -> f64 {
    (0..5).map(|i| a[i] * b[i]).sum()
}

fn on_edge(p: &Point, a: &Point, b: &Point) -> f64 {
    let (ab, ap) = (sub(b, a), sub(p, a));
    let length = dot(&ab, &ab);
    let t = if length > 0.0 { (dot(&ab, &ap) / length).clamp(0.0, 1.0) } else { 0.0 };
    let r: Point = std::array::from_fn(|i| ap[i] - t * ab[i]);
    dot(&r, &r)
}

fn distance2(p: &Point, [a, b, c]: &[Point; 3]) -> f64 {
    let (u, v, w) = (sub(b, a), sub(c, a), sub(p, a));
    let (uu, uv, vv) = (dot(&u, &u), dot(&u, &v), dot(&v, &v));
    let (wu, wv) = (dot(&w, &u), dot(&w, &v));
    let area = uu * vv - uv * uv;
    let (s, t) = ((vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area);
    // In slivers, rounding leaves nothing of `s` and `t`. Then the edges know better.
    let edges = on_edge(p, a, b).min(on_edge(p, b, c)).min(on_edge(p, c, a));
    if area > 0.0 && s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
        let r: Point = std::array::from_fn(|i| w[i] - s * u[i] - t * v[i]);
        return dot(&r, &r).min(edges);
    }
    edges
}

impl Surface {
    pub(crate) fn new(shape: &Shape, triangles: &[[u32; 3]]) -> Self {
        let scale = metres_per_uv(shape);
        let point = |i: u32| {
            let DVec3 { x, y, z } = shape.positions[i as usize].as_dvec3();
            let uv = if scale > 0.0 { shape.uvs[i as usize].as_dvec2() } else { DVec2::ZERO };
            [x, y, z, scale * uv.x, scale * uv.y]
        };
        let mut triangles: Vec<_> = triangles.iter().map(|t| t.map(point)).collect();
        // A heap of boxes over halves, down to single triangles.
        let size = triangles.len().next_power_of_two();
        let mut boxes = vec![([f64::INFINITY; 5], [f64::NEG_INFINITY; 5]); 2 * size];
        halve(&mut triangles, 1, size, &mut boxes);
        Self { triangles, boxes }
    }

    fn nearest(&self, p: &Point) -> f64 {
        let mut best = f64::INFINITY;
        self.search(p, 1, 0, self.boxes.len() / 2, &mut best);
        best.sqrt()
    }

    fn search(&self, p: &Point, place: usize, first: usize, size: usize, best: &mut f64) {
        if self.away(p, place) >= *best || first >= self.triangles.len() {
            return;
        }
        if size == 1 {
            *best = best.min(distance2(p, &self.triangles[first]));
            return;
        }
        let half = size / 2;
        let mut order = [(2 * place, first), (2 * place + 1, first + half)];
        if self.away(p, order[1].0) < self.away(p, order[0].0) {
            order.swap(0, 1);
        }
        for (place, first) in order {
            self.search(p, place, first, half, best);
        }
    }

    fn away(&self, p: &Point, place: usize) -> f64 {
        let (low, high) = &self.boxes[place];
        (0..5).map(|i| (low[i] - p[i]).max(p[i] - high[i]).max(0.0).powi(2)).sum()
    }

    /// The largest distance of `count` random points, half of them on edges, to `other`. Each
    /// triangle gets its turn.
    pub(crate) fn farthest(&self, other: &Surface, count: usize, random: &mut Random) -> f64 {
        let count = count.max(self.triangles.len());
        let mut worst = 0.0f64;
        for i in 0..count {
            let [a, b, c] = &self.triangles[i % self.triangles.len()];
            let (mut s, mut t) = (f64::from(random.next()), f64::from(random.next()));
            if i % 2 == 0 {
                t = if i % 4 == 0 { 0.0 } else { 1.0 - s };
            } else if s + t > 1.0 {
                (s, t) = (1.0 - s, 1.0 - t);
            }
            let p: Point = std::array::from_fn(|i| a[i] + s * (b[i] - a[i]) + t * (c[i] - a[i]));
            worst = worst.max(other.nearest(&p));
        }
        worst
    }
}

fn halve(own: &mut [[Point; 3]], place: usize, size: usize, boxes: &mut [(Point, Point)]) {
    let (mut low, mut high) = ([f64::INFINITY; 5], [f64::NEG_INFINITY; 5]);
    for p in own.as_flattened() {
        for i in 0..5 {
            low[i] = low[i].min(p[i]);
            high[i] = high[i].max(p[i]);
        }
    }
    boxes[place] = (low, high);
    let half = size / 2;
    if size == 1 {
        return;
    }
    if own.len() > half {
        let axis = (0..5).max_by(|&a, &b| (high[a] - low[a]).total_cmp(&(high[b] - low[b])));
        let axis = axis.unwrap();
        let center = |t: &[Point; 3]| t[0][axis] + t[1][axis] + t[2][axis];
        own.select_nth_unstable_by(half, |a, b| center(a).total_cmp(&center(b)));
        let (a, b) = own.split_at_mut(half);
        halve(a, 2 * place, half, boxes);
        halve(b, 2 * place + 1, half, boxes);
    } else {
        halve(own, 2 * place, half, boxes);
    }
}
