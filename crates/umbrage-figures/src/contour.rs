//! Finds contour lines of a smooth field by marching triangles.

/// Line segments along which a field has the value `level`, in the coordinates (column, row) of the
/// grid. `values` holds the grid row by row, with `columns` points in a row. Each cell is cut into
/// two triangles, in which the field is interpolated linearly.
pub(crate) fn segments(values: &[f64], columns: usize, level: f64) -> Vec<[[f64; 2]; 2]> {
    let rows = values.len() / columns;
    let mut found = Vec::new();
    for row in 0..rows.saturating_sub(1) {
        for column in 0..columns - 1 {
            let [a, b] = [[column, row], [column + 1, row]];
            let [c, d] = [[column, row + 1], [column + 1, row + 1]];
            for triangle in [[a, b, d], [a, d, c]] {
                found
                    .extend(cut(triangle
                        .map(|[x, y]| ([x as f64, y as f64], values[y * columns + x] - level))));
            }
        }
    }
    found
}

/// The segment along which a triangle with corners (position, value) has the value 0, if any.
fn cut(triangle: [([f64; 2], f64); 3]) -> Option<[[f64; 2]; 2]> {
    let edges = [[0, 1], [1, 2], [2, 0]].map(|[i, j]| {
        let ((p, a), (q, b)) = (triangle[i], triangle[j]);
        // A corner with value 0 counts as positive, so that the contour crosses two edges or none.
        ((a >= 0.0) != (b >= 0.0)).then(|| {
            let share = a / (a - b);
            [0, 1].map(|k| p[k] + (q[k] - p[k]) * share)
        })
    });
    let mut crossings = edges.into_iter().flatten();
    Some([crossings.next()?, crossings.next()?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn circle_is_found() {
        let n = 41;
        let field: Vec<f64> =
            (0..n * n).map(|i| ((i % n) as f64 - 20.0).hypot((i / n) as f64 - 20.0)).collect();
        let circle = segments(&field, n, 12.0);
        let radius = |[x, y]: [f64; 2]| (x - 20.0).hypot(y - 20.0);
        assert!(circle.iter().flatten().all(|&p| (radius(p) - 12.0).abs() < 0.02));
        let length: f64 = circle.iter().map(|[p, q]| (p[0] - q[0]).hypot(p[1] - q[1])).sum();
        assert!((length / (std::f64::consts::TAU * 12.0) - 1.0).abs() < 0.01, "{length}");
        assert!(segments(&field, n, 100.0).is_empty());
    }
}
