//! Ignores tests, with the reason, where what they need is missing: third-party scenes, a GPU, a
//! browser. It is decided when the tests are built, as `#[ignore]` can be at no other time.

use proc_macro::{Delimiter, Literal, TokenStream, TokenTree};

/// For each need: its name, and why it is missing, if it is.
const NEEDS: [(&str, &str); 3] = [
    ("scenes", env!("MISSING_SCENES")),
    ("gpu", env!("MISSING_GPU")),
    ("browser", env!("MISSING_BROWSER")),
];

/// `#[needs(scenes)]`, `#[needs(gpu)]`, `#[needs(browser)]` or several: a test that is ignored
/// where one of these is missing. Stands above `#[test]`.
#[proc_macro_attribute]
pub fn needs(names: TokenStream, test: TokenStream) -> TokenStream {
    if !is_test(&test) {
        return error("`#[needs]` must stand above `#[test]`, which else overlooks `#[ignore]`");
    }
    let names = names.to_string();
    let mut reasons = Vec::new();
    for name in names.split(',').map(str::trim) {
        match NEEDS.iter().find(|need| need.0 == name) {
            None => return error(&format!("`{name}` must be scenes, gpu or browser")),
            Some((_, "")) => {}
            Some((_, reason)) => reasons.push(*reason),
        }
    }
    if reasons.is_empty() {
        return test;
    }
    let mut ignored = parse(&format!("#[ignore = {:?}]", reasons.join("; ")));
    ignored.extend(test);
    ignored
}

/// The folder of third-party scenes, a string literal.
#[proc_macro]
pub fn third_party_scenes(_: TokenStream) -> TokenStream {
    TokenTree::from(Literal::string(env!("THIRD_PARTY_SCENES"))).into()
}

/// Whether `#[test]` is still among an item's attributes.
fn is_test(item: &TokenStream) -> bool {
    item.clone().into_iter().any(|token| {
        matches!(token, TokenTree::Group(g)
            if g.delimiter() == Delimiter::Bracket && g.stream().to_string() == "test")
    })
}

fn error(text: &str) -> TokenStream {
    parse(&format!("compile_error!({text:?});"))
}

fn parse(code: &str) -> TokenStream {
    code.parse().expect("valid tokens")
}
