use crate::desk::Desk;
use std::collections::HashMap;

/// A table's rows, by heading.
fn table(desk: &Desk, file: &str) -> Vec<HashMap<String, String>> {
    let mut csv = csv::Reader::from_path(desk.path(file)).unwrap();
    let rows: Vec<_> = csv.deserialize().map(Result::unwrap).collect();
    assert!(!rows.is_empty(), "{file}");
    rows
}

/// Wherever a column has a measured one beside it, both agree in every row that has both.
fn assert_measured(desk: &Desk, file: &str, tolerance: f64) {
    let mut compared = 0;
    for row in table(desk, file) {
        for (heading, closed) in &row {
            let Some(measured) = row.get(&format!("{heading}_measured")) else { continue };
            if let (Ok(closed), Ok(measured)) = (closed.parse::<f64>(), measured.parse::<f64>()) {
                assert!(
                    (closed / measured - 1.0).abs() <= tolerance,
                    "{file}: {heading} is {closed}, measured {measured}, in {row:?}"
                );
                compared += 1;
            }
        }
    }
    assert!(compared > 0, "{file} compares nothing");
}

/// The one value of a column where others have these values.
fn value(rows: &[HashMap<String, String>], at: &[(&str, &str)], column: &str) -> f64 {
    let is_here = |row: &&HashMap<String, String>| at.iter().all(|(c, v)| row[*c] == *v);
    let found: Vec<_> = rows.iter().filter(is_here).collect();
    assert_eq!(found.len(), 1, "{at:?}");
    found[0][column].parse().unwrap()
}

#[test]
fn planned_maps_have_the_papers_storage() {
    let desk = Desk::new();
    let only = ["--only", "wp-storage", "--only", "wp-fig10"];
    desk.succeed(&[&["figures", "-o", "figures"][..], &only].concat());
    // W&P Eqs. 17, 18, 20 and 21 by hand, for f/n = 1000 and φ = 30°.
    let rows = table(&desk, "figures/wp-storage.csv");
    for (slices, expected) in [
        ("1", [865_159.38, 865.159, 1e6, 1999.0]),
        ("2", [1677.279, 53.0402, 2000.0, 123.4911]),
        ("4", [90.06444, 16.01597, 126.4911, 37.98731]),
        ("8", [22.53079, 9.501156, 44.98731, 22.94198]),
        ("16", [11.52087, 7.481441, 37.94198, 18.27765]),
    ] {
        let columns = ["zp_overhead", "zp_w_overhead", "zp_behind", "fp_zp_w_behind"];
        for (column, expected) in columns.iter().zip(expected) {
            for column in [column.to_string(), format!("{column}_measured")] {
                let found = value(&rows, &[("slices", slices)], &column);
                assert!((found / expected - 1.0).abs() < 1e-6, "{column} of {slices}: {found}");
            }
        }
    }
    let rows = table(&desk, "figures/wp-fig10.csv");
    let log = value(&rows, &[("scheme", "logarithmic")], "storage_factor_measured");
    assert!((log / 5.98229 - 1.0).abs() < 1e-5, "{log}");
    assert_measured(&desk, "figures/wp-fig10.csv", 1e-6);
}

#[test]
fn measured_errors_are_those_of_the_closed_forms() {
    let desk = Desk::new();
    let names = ["lispsm-fig6", "wp-fig5", "wp-fig6", "wp-fig12", "wp-fig13"];
    let only: Vec<&str> = names.iter().flat_map(|name| ["--only", *name]).collect();
    desk.succeed(&[&["figures", "-o", "figures"][..], &only].concat());
    for file in
        ["lispsm-fig6", "wp-fig5", "wp-fig6", "wp-fig12-overhead", "wp-fig12-behind", "wp-fig13"]
    {
        assert_measured(&desk, &format!("figures/{file}.csv"), 1e-6);
    }
    // LiSPSM Eq. 3 by hand at both ends, for λ = n + √(n f) = 11.
    let rows = table(&desk, "figures/lispsm-fig6.csv");
    let lispsm = |z: &str| value(&rows, &[("technique", "LiSPSM"), ("z", z)], "dp_ds_measured");
    for end in ["1", "100"] {
        assert!((lispsm(end) - 99.0 * 11.0 / 110.0).abs() < 1e-9, "{}", lispsm(end));
    }
}

#[test]
fn the_page_shows_every_file_and_needs_nothing_else() {
    let desk = Desk::new();
    desk.succeed(&["figures", "-o", "figures", "--only", "wp-storage", "--only", "wp-fig5"]);
    let page = std::fs::read_to_string(desk.path("figures/index.html")).unwrap();
    let files = std::fs::read_dir(desk.path("figures")).unwrap();
    let mut names: Vec<String> =
        files.map(|f| f.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    assert_eq!(
        names,
        [
            "figures.json",
            "index.html",
            "wp-fig5-s.svg",
            "wp-fig5-t.svg",
            "wp-fig5.csv",
            "wp-storage.csv"
        ]
    );
    for name in names.iter().filter(|n| n.starts_with("wp-")) {
        let attribute = if name.ends_with("svg") { "src" } else { "href" };
        assert!(page.contains(&format!("{attribute}=\"{name}\"")), "{name}");
    }
    assert!(!page.contains("https://"));
    // The small table is on the page itself.
    assert!(page.contains("<td>865.16</td>"));
    let svg = std::fs::read_to_string(desk.path("figures/wp-fig5-s.svg")).unwrap();
    assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"));
    assert!(svg.contains("λ = 5.47 (LiSPSM)"));
}

#[test]
fn former_figures_are_replaced_and_strangers_are_not() {
    let desk = Desk::new();
    let figures = |name: &str| desk.run(&["figures", "-o", "figures", "--only", name]);
    assert_eq!(figures("wp-fig10").code, 0);
    assert_eq!(figures("wp-storage").code, 0);
    assert!(!desk.path("figures/wp-fig10.csv").exists());
    desk.write("figures/notes.csv", "mine");
    let refused = figures("wp-storage");
    assert_eq!(refused.code, 1);
    assert!(refused.stderr.contains("--output: figures holds notes.csv"), "{}", refused.stderr);
    assert!(desk.path("figures/notes.csv").exists());
    std::fs::create_dir(desk.path("other")).unwrap();
    desk.write("other/wp-storage.csv", "mine too");
    let refused = desk.run(&["figures", "-o", "other", "--only", "wp-storage"]);
    assert_eq!(refused.code, 1);
    assert!(refused.stderr.contains("holds something other than figures"), "{}", refused.stderr);
}

#[test]
fn unknown_figures_are_refused_with_the_known_ones() {
    let desk = Desk::new();
    let run = desk.run(&["figures", "-o", "figures", "--only", "wp-fig99"]);
    assert_eq!(run.code, 2);
    for part in ["--only", "wp-fig99", "lispsm-fig6", "wp-storage"] {
        assert!(run.stderr.contains(part), "{part}: {}", run.stderr);
    }
    assert!(!desk.path("figures").exists());
}

/// Makes these figures in the folder `figures`.
fn make(desk: &Desk, names: &[&str]) {
    let only: Vec<&str> = names.iter().flat_map(|name| ["--only", *name]).collect();
    desk.succeed(&[&["figures", "-o", "figures"][..], &only].concat());
}

fn number(row: &HashMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap()
}

#[test]
fn errors_at_any_angle_are_measured() {
    let desk = Desk::new();
    make(&desk, &["ours-theta", "ours-critical", "ours-gain"]);
    assert_measured(&desk, "figures/ours-critical.csv", 1e-6);
    assert_measured(&desk, "figures/ours-gain.csv", 1e-6);
    let rows = table(&desk, "figures/ours-theta.csv");
    // Found by sampling λ, no finer than to a hundredth: M_q·M_p and the largest E_q·E_p of an even
    // map, LiSPSM and the best storage, and the best largest E_q·E_p with its M_q·M_p.
    for (theta, expected) in [
        ("90", [34_300.0, 34_300.0, 343.0, 343.0, 343.0, 343.0, 343.0, 74.4]),
        ("75", [38_400.0, 38_400.0, 522.0, 477.0, 520.0, 520.0, 548.0, 118.0]),
        ("60", [39_800.0, 39_800.0, 824.0, 823.0, 764.0, 764.0, 856.0, 185.0]),
        ("45", [38_500.0, 38_500.0, 1900.0, 1900.0, 1230.0, 1230.0, 1540.0, 332.0]),
        ("31", [35_000.0, 35_000.0, 6400.0, 6400.0, 3520.0, 3520.0, 7800.0, 1690.0]),
    ] {
        let warps = ["uniform", "LiSPSM as published", "adaptive (storage)", "adaptive (area)"];
        let columns = warps.iter().flat_map(|w| ["storage", "product"].map(|c| (w, c)));
        for ((warp, column), expected) in columns.zip(expected) {
            let at = [("theta_deg", theta), ("warp", warp)];
            for column in [column.to_owned(), format!("{column}_measured")] {
                let found = value(&rows, &at, &column);
                assert!((found / expected - 1.0).abs() < 0.01, "{column} at {at:?}: {found}");
            }
        }
    }
    // The planner fades warps out, or limits them, in this range alone.
    for row in rows.iter().filter(|r| number(r, "theta_deg") >= 40.0) {
        for column in ["storage", "product"] {
            let (closed, measured) =
                (number(row, column), number(row, &format!("{column}_measured")));
            assert!((closed / measured - 1.0).abs() < 1e-6, "{column} of {row:?}");
        }
    }
}

#[test]
fn printed_formulas_are_wrong_and_corrected_ones_right() {
    let desk = Desk::new();
    make(&desk, &["misprints"]);
    assert_measured(&desk, "figures/misprints.csv", 1e-6);
    let rows = table(&desk, "figures/misprints.csv");
    let off = |row: &HashMap<String, String>| {
        number(row, "value_printed") / number(row, "value_measured")
    };
    assert!(rows.iter().all(|row| (off(row) - 1.0).abs() > 0.1), "{rows:?}");
    let of = |quantity: &str| {
        let row = rows.iter().find(|r| r["quantity"].starts_with(quantity));
        off(row.unwrap_or_else(|| panic!("{quantity}")))
    };
    // By how much each slip must be off, n = 2 m and φ = 30°.
    for (quantity, factor) in [
        ("pixel's width", 0.5),
        ("M_s", 2.0),
        ("F_p, θ = 60°", 2.0 / 3_f64.sqrt()),
        ("F_p, θ = 20°", 3_f64.sqrt() / 20_f64.to_radians().cos()),
    ] {
        assert!((of(quantity) / factor - 1.0).abs() < 1e-6, "{quantity}: {}", of(quantity));
    }
}

#[test]
fn shadow_test_of_waves_is_the_papers() {
    let desk = Desk::new();
    make(&desk, &["csm-fig3", "csm-fig6"]);
    let rows = table(&desk, "figures/csm-fig3.csv");
    let at = |part: &str, order: &str, x: f64| {
        let here = |r: &&HashMap<String, String>| {
            r["part"] == part && r["order"] == order && (number(r, "d_minus_z") - x).abs() < 1e-9
        };
        rows.iter().find(here).map(|r| number(r, "light")).unwrap()
    };
    // The series summed by hand.
    for (order, expected) in
        [("4", [0.9895, 0.8670, 0.5797, 0.5]), ("16", [0.9941, 0.9916, 0.8026, 0.5])]
    {
        for (x, expected) in [-0.2, -0.05, -0.01, 0.0].into_iter().zip(expected) {
            let found = at("orders", order, x);
            assert!((found - expected).abs() < 1e-4, "M = {order} at {x}: {found}");
            assert!((at("scale", order, x) - 2.0 * expected).abs() < 2e-4);
        }
        assert!((at("offset", order, 0.0) - 1.0).abs() < 1e-6);
    }
    // 8 bits are seen, and do no harm: at most half a step of 1/127 in sine and cosine of each
    // term.
    for file in ["csm-fig3", "csm-fig6"] {
        let rows = table(&desk, &format!("figures/{file}.csv"));
        let off = rows.iter().map(|r| (number(r, "light") - number(r, "light_measured")).abs());
        let worst = off.fold(0.0, f64::max);
        assert!((1e-4..0.017).contains(&worst), "{file}: {worst}");
    }
}

#[test]
fn side_views_and_their_pictures_are_complete() {
    let desk = Desk::new();
    make(&desk, &["theory-fig3"]);
    assert_measured(&desk, "figures/theory-fig3.csv", 1e-6);
    for degrees in ["90", "60", "30"] {
        let svg = std::fs::read_to_string(desk.path(&format!("figures/theory-fig3-{degrees}.svg")));
        // Three side views, a map and a picture for each of four techniques, all in the file
        // itself.
        assert_eq!(svg.unwrap().matches("href=\"data:image/png;base64,").count(), 20);
    }
}

#[test]
fn filters_are_really_rendered() {
    let desk = Desk::new();
    make(&desk, &["csm-fig6", "csm-fig7", "csm-fig8"]);
    for (file, count) in [("csm-fig6-rendered", 10), ("csm-fig7", 6), ("csm-fig8", 9)] {
        let svg = std::fs::read_to_string(desk.path(&format!("figures/{file}.svg"))).unwrap();
        let pictures: std::collections::HashSet<&str> = svg
            .split("data:image/png;base64,")
            .skip(1)
            .map(|p| p.split('"').next().unwrap())
            .collect();
        assert_eq!(pictures.len(), count, "{file}: pictures that differ");
    }
}
