//! The nearest point of many triangles, in the three dimensions of space or in five, where the
//! other two are those of a texture.

/// A point.
pub(crate) type Point<const D: usize> = [f32; D];

fn minus<const D: usize>(a: &Point<D>, b: &Point<D>) -> Point<D> {
    std::array::from_fn(|i| a[i] - b[i])
}

/// In `f64`, for in long thin triangles the differences of products are all that counts.
fn dot<const D: usize>(a: &Point<D>, b: &Point<D>) -> f64 {
    let mut sum = 0.0;
    for i in 0..D {
        sum += f64::from(a[i]) * f64::from(b[i]);
    }
    sum
}

/// A triangle as a corner and two edges, with the products that every query needs.
#[derive(Clone, Copy)]
pub(crate) struct Triangle<const D: usize> {
    corner: Point<D>,
    u: Point<D>,
    v: Point<D>,
    uu: f64,
    uv: f64,
    vv: f64,
}

impl<const D: usize> Triangle<D> {
    pub(crate) fn new([a, b, c]: [&Point<D>; 3]) -> Self {
        let (u, v) = (minus(b, a), minus(c, a));
        Self { corner: *a, u, v, uu: dot(&u, &u), uv: dot(&u, &v), vv: dot(&v, &v) }
    }

    /// The square of the distance to `point`, after Ericson, *Real-Time Collision Detection*,
    /// 2005, section 5.1.5. It only uses scalar products, and so holds in any dimension. Whatever
    /// rounding does, the result belongs to a point of the triangle, and is never too small.
    #[inline]
    pub(crate) fn distance2(&self, point: &Point<D>) -> f32 {
        let p = minus(point, &self.corner);
        let (d1, d2) = (dot(&self.u, &p), dot(&self.v, &p));
        if d1 <= 0.0 && d2 <= 0.0 {
            return dot(&p, &p) as f32;
        }
        let (d3, d4) = (d1 - self.uu, d2 - self.uv);
        if d3 >= 0.0 && d4 <= d3 {
            return self.distance2_to(&p, 1.0, 0.0);
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && self.uu > 0.0 {
            return self.distance2_to(&p, (d1 / self.uu).min(1.0), 0.0);
        }
        let (d5, d6) = (d1 - self.uv, d2 - self.vv);
        if d6 >= 0.0 && d5 <= d6 {
            return self.distance2_to(&p, 0.0, 1.0);
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 && self.vv > 0.0 {
            return self.distance2_to(&p, 0.0, (d2 / self.vv).min(1.0));
        }
        let va = d3 * d6 - d5 * d4;
        let (e, f) = (d4 - d3, d5 - d6);
        let sum = va + vb + vc;
        if (va <= 0.0 && e >= 0.0 && f >= 0.0 && e + f > 0.0) || sum <= 0.0 {
            let w = if e + f > 0.0 { (e / (e + f)).clamp(0.0, 1.0) } else { 0.0 };
            return self.distance2_to(&p, 1.0 - w, w);
        }
        self.distance2_to(&p, vb / sum, vc / sum)
    }

    #[inline]
    fn distance2_to(&self, p: &Point<D>, s: f64, t: f64) -> f32 {
        let (s, t) = (s as f32, t as f32);
        let mut sum = 0.0;
        for (i, &x) in p.iter().enumerate() {
            let r = x - s * self.u[i] - t * self.v[i];
            sum += r * r;
        }
        sum
    }
}

#[derive(Clone, Copy)]
struct Node<const D: usize> {
    low: Point<D>,
    high: Point<D>,
    /// The first triangle of a leaf, or the second child; the first child comes next.
    place: u32,
    /// The triangles of a leaf, or 0.
    count: u32,
}

impl<const D: usize> Node<D> {
    #[inline]
    fn distance2(&self, point: &Point<D>) -> f32 {
        let mut sum = 0.0;
        for (i, &x) in point.iter().enumerate() {
            let r = (self.low[i] - x).max(x - self.high[i]).max(0.0);
            sum += r * r;
        }
        sum
    }
}

/// The most triangles of a leaf.
const LEAF: usize = 4;

/// Triangles, ready to be asked for the nearest one.
pub(crate) struct Bvh<const D: usize> {
    nodes: Vec<Node<D>>,
    triangles: Vec<Triangle<D>>,
}

impl<const D: usize> Bvh<D> {
    /// There must be at least one triangle.
    pub(crate) fn new(points: &[Point<D>], triangles: &[[u32; 3]]) -> Self {
        let corners = |t: u32| triangles[t as usize].map(|i| &points[i as usize]);
        let centers: Vec<Point<D>> = (0..triangles.len() as u32)
            .map(|t| {
                let [a, b, c] = corners(t);
                std::array::from_fn(|i| a[i] + b[i] + c[i])
            })
            .collect();
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        let mut nodes = Vec::with_capacity(triangles.len());
        // Halves still to do: their range, and the parent that is to know the second one's place.
        let mut open = vec![(0, order.len(), None)];
        while let Some((from, to, parent)) = open.pop() {
            let place = nodes.len();
            if let Some(parent) = parent {
                let parent: &mut Node<D> = &mut nodes[parent];
                parent.place = place as u32;
            }
            let (mut low, mut high) = ([f32::INFINITY; D], [f32::NEG_INFINITY; D]);
            for &t in &order[from..to] {
                for corner in corners(t) {
                    for i in 0..D {
                        low[i] = low[i].min(corner[i]);
                        high[i] = high[i].max(corner[i]);
                    }
                }
            }
            let count = to - from;
            if count <= LEAF {
                nodes.push(Node { low, high, place: from as u32, count: count as u32 });
                continue;
            }
            nodes.push(Node { low, high, place: 0, count: 0 });
            let axis = (0..D).max_by(|&a, &b| (high[a] - low[a]).total_cmp(&(high[b] - low[b])));
            let axis = axis.unwrap_or(0);
            order[from..to].select_nth_unstable_by(count / 2, |&a, &b| {
                centers[a as usize][axis].total_cmp(&centers[b as usize][axis])
            });
            let middle = from + count / 2;
            open.push((middle, to, Some(place)));
            open.push((from, middle, None));
        }
        let triangles = order.iter().map(|&t| Triangle::new(corners(t))).collect();
        Self { nodes, triangles }
    }

    /// The square of the distance from `point` to the nearest triangle, or anything up to `enough`
    /// if that is not more than `enough`. `hint` is a triangle that may be near; afterwards, the
    /// nearest found.
    #[inline]
    pub(crate) fn distance2(&self, point: &Point<D>, enough: f32, hint: &mut u32) -> f32 {
        let mut best = self.triangles[*hint as usize].distance2(point);
        if best <= enough {
            return best;
        }
        // Each step halves the triangles, of which there are less than 2³².
        let mut stack = [(0u32, 0f32); 40];
        let mut open = 1;
        while open > 0 {
            open -= 1;
            let (place, distance) = stack[open];
            if distance >= best {
                continue;
            }
            let node = &self.nodes[place as usize];
            if node.count > 0 {
                for t in node.place..node.place + node.count {
                    let d = self.triangles[t as usize].distance2(point);
                    if d < best {
                        best = d;
                        *hint = t;
                    }
                }
                if best <= enough {
                    return best;
                }
                continue;
            }
            let children = [place + 1, node.place];
            let [a, b] = children.map(|c| (c, self.nodes[c as usize].distance2(point)));
            let (near, far) = if a.1 <= b.1 { (a, b) } else { (b, a) };
            stack[open] = far;
            stack[open + 1] = near;
            open += 2;
        }
        best
    }
}
