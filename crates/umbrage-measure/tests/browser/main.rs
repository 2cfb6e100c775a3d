//! The report in a real browser: a Chromium that is started here and only reads files.

mod chromium;
mod demo;

use chromium::Browser;
use demo::{Compared, flat, spheres_on_a_plane};
use serde_json::json;
use std::path::PathBuf;
use umbrage_measure::{Report, Rgb, Sweep, SweepPage, SweepSettings, SweptView, write_sweep};
use umbrage_testing::needs;

const RED: Rgb = [220, 30, 20];
const GREEN: Rgb = [20, 160, 60];
const BLUE: Rgb = [30, 60, 230];

/// Writes a report into a folder that is kept until the next run, so that the page can be
/// inspected.
fn report(name: &str, compared: &Compared) -> (PathBuf, Report) {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("reports").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let notices = ["Texture “bark.png” is missing; shown white.".to_owned()];
    let report = compared.write(&folder, &notices);
    (folder.join("index.html"), report)
}

/// Checks that the page reported no problem and requested only files.
fn check_quiet(browser: &Browser) {
    assert!(browser.complaints.is_empty(), "{:#?}", browser.complaints);
    let offline = |url: &&String| url.starts_with("file:") || url.starts_with("data:");
    let online: Vec<_> = browser.requests.iter().filter(|url| !offline(url)).collect();
    assert!(online.is_empty(), "{online:?}");
    assert!(!browser.requests.is_empty());
}

/// Has the page load its pictures before they are scrolled to, and checks that all of them are
/// loaded completely.
fn check_pictures(browser: &mut Browser, [w, h]: [u32; 2]) {
    browser.eval("[...document.images].forEach(i => { i.loading = 'eager' })");
    browser.wait_for("[...document.images].every(i => i.complete)");
    let wrong = browser.eval(&format!(
        "[...document.images].filter(i => i.naturalWidth !== {w} || i.naturalHeight !== {h}) \
         .map(i => `${{i.src}}: ${{i.naturalWidth}}`)"
    ));
    assert_eq!(wrong, json!([]));
}

/// Checks that nothing extends beyond the window, except elements that scroll by themselves.
fn check_fits(browser: &mut Browser, context: &str) {
    let wide = browser.eval("document.documentElement.scrollWidth - innerWidth");
    assert!(wide.as_f64().unwrap() <= 0.0, "{context}: {wide} pixels too wide");
    let outside = browser.eval(
        "[...document.body.querySelectorAll('*')] \
         .filter(e => !e.closest('.table-scroll *, .tiles *, .stage *')) \
         .filter(e => { const r = e.getBoundingClientRect(); \
           return r.width > 0 && (r.left < -1 || r.right > innerWidth + 1) }) \
         .map(e => e.outerHTML.slice(0, 120))",
    );
    assert_eq!(outside, json!([]), "{context}");
}

/// The colour at a point of the window, as the mean of 3×3 pixels.
fn seen(browser: &mut Browser, [x, y]: [f64; 2]) -> Rgb {
    let shot = browser.screenshot();
    let mut sum = [0_u32; 3];
    for (dx, dy) in (0..9).map(|i| (i % 3, i / 3)) {
        let pixel = shot.get_pixel(x as u32 + dx - 1, y as u32 + dy - 1);
        sum.iter_mut().zip(pixel.0).for_each(|(s, v)| *s += u32::from(v));
    }
    sum.map(|s| (s / 9) as u8)
}

#[needs(browser)]
#[test]
fn pictures_load_and_everything_fits_at_every_size() {
    let mut browser = Browser::start();
    let small = spheres_on_a_plane([160, 90], 20);
    let one = spheres_on_a_plane([64, 64], 1);
    let large = flat([4096, 2160], RED, &[("uniform", GREEN)]);
    let name = "lambda=0.123456789+z16+face:csm16(blur=7,attenuation=1,offset)@16384".repeat(2);
    let long = flat([90, 300], RED, &[(&name, GREEN), ("uniform", BLUE)]);
    for (name, compared) in [("many", small), ("one", one), ("large", large), ("long", long)] {
        let (index, report) = report(name, &compared);
        for (window, mobile) in
            [([360, 740], true), ([768, 1024], true), ([1280, 800], false), ([1920, 1080], false)]
        {
            browser.open(&index, window, mobile);
            check_pictures(&mut browser, report.size);
            check_fits(&mut browser, &format!("{name} at {window:?}"));
        }
        if name == "many" {
            browser.open(&index, [1440, 900], false);
            let hidden = "(t => t.scrollWidth - t.clientWidth)\
                          (document.querySelector('#measurements .table-scroll'))";
            assert_eq!(browser.eval(hidden), json!(0), "the whole table shows at 1440 pixels");
        }
    }
    check_quiet(&browser);
}

#[needs(browser)]
#[test]
fn divider_moves_by_mouse_touch_and_keyboard() {
    let (index, _) = report("divider", &flat([64, 48], RED, &[("uniform", GREEN)]));
    let mut browser = Browser::start();
    browser.open(&index, [1280, 900], false);
    check_pictures(&mut browser, [64, 48]);
    let [x, y, w, h] = browser.rect("#stage");
    // The row is not the middle one, where the grip, the magnifier or a name covers the picture.
    let at = |percent: f64| [x + w * percent / 100.0, y + h * 0.1];
    let value = "Number(document.querySelector('#divider').getAttribute('aria-valuenow'))";

    assert_eq!(seen(&mut browser, at(25.0)), RED);
    assert_eq!(seen(&mut browser, at(75.0)), GREEN);
    browser.mouse("mouseMoved", at(50.0), false);
    browser.mouse("mousePressed", at(50.0), true);
    browser.mouse("mouseMoved", at(60.0), true);
    browser.mouse("mouseMoved", at(90.0), true);
    assert_eq!(browser.eval(value), json!(90));
    assert_eq!(seen(&mut browser, at(75.0)), RED, "dragged to the right");
    browser.mouse("mouseReleased", at(90.0), false);
    browser.mouse("mouseMoved", at(30.0), false);
    assert_eq!(browser.eval(value), json!(90), "moving without pressing must not drag");

    // Dragging has moved the keyboard focus to the divider.
    for (key, expected) in [("ArrowLeft", 89), ("ArrowRight", 90), ("Home", 0), ("End", 100)] {
        browser.key(key);
        assert_eq!(browser.eval(value), json!(expected), "{key}");
    }
    assert_eq!(seen(&mut browser, at(98.0)), RED);
    browser.key("Home");
    assert_eq!(seen(&mut browser, at(25.0)), GREEN);
    let words = browser.eval("document.querySelector('#divider').getAttribute('aria-valuetext')");
    assert_eq!(words, json!("0 % Truth, rest uniform"));

    browser.open(&index, [360, 740], true);
    let [x, y, w, h] = browser.rect("#stage");
    let at = |percent: f64| [x + w * percent / 100.0, y + h * 0.1];
    browser.finger(&[at(50.0), at(45.0), at(30.0), at(10.0)]);
    assert_eq!(browser.eval(value), json!(10));
    assert_eq!(seen(&mut browser, at(25.0)), GREEN, "dragged to the left");
    browser.finger(&[at(80.0)]);
    assert_eq!(browser.eval(value), json!(10), "a tap must not move the divider");
    check_quiet(&browser);
}

#[needs(browser)]
#[test]
fn controls_choose_what_is_shown() {
    let compared = flat([64, 48], RED, &[("uniform@64", GREEN), ("lispsm@64", BLUE)]);
    let (index, _) = report("controls", &compared);
    let mut browser = Browser::start();
    browser.open(&index, [1280, 900], false);
    check_pictures(&mut browser, [64, 48]);
    let [x, y, w, h] = browser.rect("#stage");
    let (left, right) = ([x + w * 0.25, y + h * 0.1], [x + w * 0.75, y + h * 0.1]);
    let choose = |browser: &mut Browser, side: &str, value: u32| {
        browser.eval(&format!(
            "(() => {{ const s = document.getElementById({side:?}); s.value = {value}; \
             s.dispatchEvent(new Event('change', {{bubbles: true}})) }})()"
        ));
        browser.wait_for("[...document.images].every(i => i.complete)");
    };
    let kind = |browser: &mut Browser, kind: &str| {
        browser.click(&format!("#kinds input[value={kind}]"));
        browser.wait_for("[...document.images].every(i => i.complete)");
        browser.rect("#stage");
    };
    let both = |browser: &mut Browser| [seen(browser, left), seen(browser, right)];

    choose(&mut browser, "right", 2);
    assert_eq!(both(&mut browser), [RED, BLUE]);
    choose(&mut browser, "left", 1);
    assert_eq!(both(&mut browser), [GREEN, BLUE]);
    browser.click("#swap");
    browser.rect("#stage");
    assert_eq!(both(&mut browser), [BLUE, GREEN]);

    // A click on a tile shows its technique on the right and the truth on the left.
    browser.click(".tile[data-item='2']");
    browser.click(".tile[data-item='0']");
    browser.rect("#stage");
    assert_eq!(both(&mut browser), [RED, BLUE]);

    kind(&mut browser, "visibility");
    assert_eq!(both(&mut browser), [[255; 3], [0; 3]]);
    kind(&mut browser, "difference");
    assert_eq!(
        both(&mut browser),
        [RED, umbrage_measure::FALSE_SHADOW],
        "the truth has no difference"
    );
    let legends = "[...document.querySelectorAll('.legend')].filter(e => e.offsetParent)\
                   .map(e => e.dataset.legend)";
    assert_eq!(browser.eval(legends), json!(["difference"]));
    kind(&mut browser, "error");
    let eight = umbrage_measure::ErrorScale::default().color(8.0).unwrap();
    assert_eq!(both(&mut browser), [RED, eight]);
    assert_eq!(browser.eval(legends), json!(["error"]));
    kind(&mut browser, "color");

    // The small pictures open in the viewer.
    browser.click("#result-1 a[data-kind=color]");
    browser.rect("#stage");
    browser.wait_for("[...document.images].every(i => i.complete)");
    assert_eq!(both(&mut browser), [RED, GREEN]);
    assert_eq!(browser.eval("location.pathname.endsWith('index.html')"), json!(true));
    check_quiet(&browser);
}

#[needs(browser)]
#[test]
fn magnifier_shows_the_same_place_of_all_techniques() {
    // The upper left quarter of each picture has the technique's colour, and the rest is black.
    let mut compared = flat([640, 480], RED, &[("uniform", GREEN), ("lispsm", BLUE)]);
    let cut = |image: &umbrage_measure::Image<Rgb>| {
        umbrage_measure::Image::from_fn([640, 480], |x, y| {
            if x < 320 && y < 240 { *image.at(0, 0) } else { [0; 3] }
        })
        .unwrap()
    };
    compared.color = cut(&compared.color);
    compared.results.iter_mut().for_each(|r| r.color = cut(&r.color));
    let (index, _) = report("magnifier", &compared);
    let mut browser = Browser::start();
    browser.open(&index, [1280, 1000], false);
    check_pictures(&mut browser, [640, 480]);
    let tiles = |browser: &mut Browser| -> Vec<Rgb> {
        (0..3)
            .map(|i| {
                let at = browser.middle(&format!(".tile[data-item='{i}'] canvas"));
                seen(browser, at)
            })
            .collect()
    };
    let [x, y, w, h] = browser.rect("#stage");
    browser.mouse("mouseMoved", [x + w * 0.9, y + h * 0.9], false);
    assert_eq!(tiles(&mut browser), [[0; 3]; 3]);
    let [x, y, w, h] = browser.rect("#stage");
    browser.mouse("mouseMoved", [x + w * 0.25, y + h * 0.25], false);
    assert_eq!(tiles(&mut browser), [RED, GREEN, BLUE]);

    // The keyboard moves the magnifier out of the coloured quarter.
    browser.eval("document.querySelector('#reticle').focus()");
    for _ in 0..200 {
        browser.key("ArrowDown");
    }
    assert_eq!(tiles(&mut browser), [[0; 3]; 3]);

    // A tap of a finger moves the magnifier.
    browser.open(&index, [360, 740], true);
    check_pictures(&mut browser, [640, 480]);
    let [x, y, w, h] = browser.rect("#stage");
    browser.finger(&[[x + w * 0.2, y + h * 0.1]]);
    assert_eq!(tiles(&mut browser)[..2], [RED, GREEN]);
    // The magnifier moves far away, and the button on the card brings it back. All pixels are
    // wrong, so the first square counts as the worst.
    browser.rect("#stage");
    browser.finger(&[[x + w * 0.9, y + h * 0.9]]);
    browser.click("#result-2 .worst");
    assert_eq!(tiles(&mut browser)[..2], [RED, GREEN]);
    check_quiet(&browser);
}

#[needs(browser)]
#[test]
fn magnifier_opens_where_techniques_differ() {
    // Both are wrong everywhere, but one of them is right in the last square of the picture.
    let mut compared = flat([640, 480], RED, &[("uniform", GREEN), ("lispsm", GREEN)]);
    let last = |x, y| if x >= 608 && y >= 448 { RED } else { GREEN };
    compared.results[1].color = umbrage_measure::Image::from_fn([640, 480], last).unwrap();
    let (index, _) = report("opening", &compared);
    let mut browser = Browser::start();
    browser.open(&index, [1280, 1000], false);
    browser.wait_for("document.querySelector('#reticle').ariaLabel !== null");
    let label = browser.eval("document.querySelector('#reticle').ariaLabel");
    assert!(label.as_str().unwrap().starts_with("Magnifier at column 624, row 464"), "{label}");
    check_quiet(&browser);
}

#[needs(browser)]
#[test]
fn table_sorts_by_every_column() {
    let (index, report) = report("table", &spheres_on_a_plane([96, 54], 20));
    let mut browser = Browser::start();
    browser.open(&index, [1920, 1080], false);
    let columns = browser.eval("document.querySelectorAll('#table thead th').length");
    let columns = columns.as_u64().unwrap();
    assert_eq!(columns, 18, "17 figures, for nobody has a filter time or flicker, beside the name");
    let keys = |browser: &mut Browser, column: u64| -> Vec<String> {
        let keys = browser.eval(&format!(
            "[...document.querySelectorAll('#table tbody tr')].map(r => r.cells[{column}].dataset.key)"
        ));
        serde_json::from_value(keys).unwrap()
    };
    for column in 0..columns {
        let before = keys(&mut browser, column);
        for (direction, sign) in [("ascending", 1.0), ("descending", -1.0)] {
            let heading = format!("#table thead th:nth-child({})", column + 1);
            browser.click(&format!("{heading} button"));
            let sort = format!("document.querySelector('{heading}').ariaSort");
            assert_eq!(browser.eval(&sort), json!(direction));
            let sorted = keys(&mut browser, column);
            let mut same = sorted.clone();
            same.sort();
            let mut expected = before.clone();
            expected.sort();
            assert_eq!(same, expected, "no row may be lost");
            let unknown = sorted.iter().position(String::is_empty).unwrap_or(sorted.len());
            assert!(sorted[unknown..].iter().all(String::is_empty), "unknown figures come last");
            if column > 0 {
                let values: Vec<f64> =
                    sorted[..unknown].iter().map(|k| k.parse::<f64>().unwrap() * sign).collect();
                assert!(values.is_sorted(), "column {column} {direction}: {values:?}");
            }
        }
    }
    // The storage factor is the tenth figure, and a fifth of the techniques have none.
    assert_eq!(keys(&mut browser, 10).iter().filter(|k| k.is_empty()).count(), 4);
    // The technique with the fewest wrong pixels is highlighted.
    let best = "[...document.querySelectorAll('#table tbody tr')]\
                .filter(r => r.cells[2].matches('.best')).map(r => Number(r.cells[2].dataset.key))";
    let best: Vec<f64> = serde_json::from_value(browser.eval(best)).unwrap();
    let wrong = report.results.iter().filter_map(|r| r.metrics.wrong_fraction);
    let least = wrong.fold(1.0, f64::min);
    assert!(!best.is_empty() && best.iter().all(|&b| b == least), "{best:?}, {least}");
    check_quiet(&browser);
}

#[needs(browser)]
#[test]
fn text_of_users_stays_text() {
    let nasty = "</script><script>window.owned=1</script><img src=x onerror=owned=1>'\"&<!--";
    let mut compared = flat([16, 16], RED, &[(nasty, GREEN), ("{{ 7*7 }}", BLUE)]);
    compared.scene = nasty.to_owned();
    let (index, _) = report("text", &compared);
    let mut browser = Browser::start();
    browser.open(&index, [1280, 800], false);
    check_pictures(&mut browser, [16, 16]);
    assert_eq!(browser.eval("document.querySelector('h1').textContent"), json!(nasty));
    assert_eq!(browser.eval("document.querySelector('#right-tag').textContent"), json!(nasty));
    assert_eq!(
        browser.eval("document.querySelector('#result-2 h3').textContent"),
        json!("{{ 7*7 }}")
    );
    assert_eq!(browser.eval("typeof owned"), json!("undefined"));
    check_quiet(&browser);
}

#[needs(browser)]
#[test]
fn works_without_scripts_and_on_paper() {
    let (index, report) = report("paper", &spheres_on_a_plane([96, 54], 5));
    let mut browser = Browser::start();
    let shown = |browser: &mut Browser, selector: &str| {
        let visible = format!(
            "[...document.querySelectorAll({selector:?})].filter(e => e.checkVisibility()).length"
        );
        browser.eval(&visible).as_u64().unwrap()
    };
    browser.call("Emulation.setScriptExecutionDisabled", json!({"value": true}));
    browser.open(&index, [1280, 800], false);
    let n = report.results.len() as u64;
    assert_eq!(shown(&mut browser, "#compare, .worst"), 0, "nothing that needs a script");
    assert_eq!(shown(&mut browser, "#table tbody tr"), n);
    assert_eq!(shown(&mut browser, ".card img"), 2 + 3 * n);
    let loaded = "[...document.querySelectorAll('.card img')].every(i => i.naturalWidth === 96)";
    browser.wait_for(loaded);

    browser.call("Emulation.setScriptExecutionDisabled", json!({"value": false}));
    browser.open(&index, [1280, 800], false);
    browser.call("Emulation.setEmulatedMedia", json!({"media": "print"}));
    assert_eq!(shown(&mut browser, "#compare, nav, .worst"), 0, "nothing to click on paper");
    assert_eq!(shown(&mut browser, "#table tbody tr"), n);
    check_quiet(&browser);
}

#[needs(browser)]
#[test]
fn a_sweeps_page_leads_to_its_views() {
    let nasty = "<img src=x onerror=owned=1>'\"&<!--";
    let names = ["uniform", "lispsm:pcf3@64"];
    let mut other = flat([64, 48], BLUE, &[(names[0], GREEN), (names[1], RED)]);
    other.scene = nasty.to_owned();
    let mut spheres = spheres_on_a_plane([160, 90], 2);
    spheres.results.iter_mut().zip(names).for_each(|(r, name)| r.name = name.to_owned());
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("reports/sweep");
    let view = |name: &str, compared: Option<&Compared>| SweptView {
        name: name.to_owned(),
        scene: nasty.to_owned(),
        folder: format!("views/{name}"),
        outcome: compared
            .map(|c| report(&format!("sweep/views/{name}"), c).1.without_times())
            .ok_or_else(|| nasty.to_owned()),
    };
    let sweep = Sweep {
        name: nasty.to_owned(),
        share: None,
        settings: SweepSettings {
            shadows: names.map(str::to_owned).to_vec(),
            max_error: Some(1.5),
            size: [160, 90],
            samples: 4,
            light_size: None,
            fit: "box".to_owned(),
            opaque: true,
            full_detail: false,
            animation: Some(nasty.to_owned()),
            time_s: Some(1.5),
            without: vec![nasty.to_owned()],
            ground: true,
            backend: "reference".to_owned(),
        },
        views: vec![
            view("spheres", Some(&spheres)),
            view("broken", None),
            view("a flat (one)", Some(&other)),
        ],
    };
    write_sweep(&folder, &SweepPage { sweep: &sweep, command: Some(nasty) }).unwrap();
    let index = folder.join("index.html");
    let mut browser = Browser::start();
    for (window, mobile) in [([360, 740], true), ([1280, 800], false)] {
        browser.open(&index, window, mobile);
        browser.wait_for("[...document.images].every(i => i.complete && i.naturalWidth > 0)");
        check_fits(&mut browser, &format!("sweep at {window:?}"));
    }
    assert_eq!(browser.eval("document.querySelector('h1').textContent"), json!(nasty));
    assert_eq!(browser.eval("typeof owned"), json!("undefined"));
    assert_eq!(browser.eval("document.querySelectorAll('#means tbody tr').length"), json!(2));
    assert_eq!(browser.eval("document.querySelectorAll('#views td.failed').length"), json!(1));

    let column = |browser: &mut Browser, i: u32| {
        browser.eval(&format!(
            "[...document.querySelectorAll('#table tbody tr')].map(r => r.cells[{i}].dataset.key)"
        ))
    };
    let [flat, spheres] = ["a flat (one)", "spheres"];
    assert_eq!(column(&mut browser, 0), json!([spheres, spheres, flat, flat]));
    browser.click("#table thead th:nth-child(1) button");
    assert_eq!(column(&mut browser, 0), json!([flat, flat, spheres, spheres]));
    browser.click("#table thead th:nth-child(2) button");
    assert_eq!(column(&mut browser, 1), json!([names[1], names[1], names[0], names[0]]));

    browser.click("#views tbody tr:last-child a");
    browser.wait_for(
        "decodeURIComponent(location.pathname).endsWith('/views/a flat (one)/index.html') && \
         document.querySelector('#stage') !== null",
    );
    check_quiet(&browser);
}
