//! Ignores tests, and states the reason, where third-party scenes, a GPU, a browser or a screen
//! for windows that they need is missing. This is decided when tests are built, because `#[ignore]`
//! acts at compile time.

use proc_macro::{Delimiter, Literal, TokenStream, TokenTree};

/// The name of each need, and the reason why it is missing; the reason is empty if it is present.
const NEEDS: [(&str, &str); 4] = [
    ("scenes", env!("MISSING_SCENES")),
    ("gpu", env!("MISSING_GPU")),
    ("browser", env!("MISSING_BROWSER")),
    ("window", env!("MISSING_WINDOW")),
];

/// Ignores a test where one of its needs is missing: `#[needs(scenes)]`, `#[needs(gpu)]`,
/// `#[needs(browser)]`, `#[needs(window)]`, or several names with commas. The attribute must stand above `#[test]`.
#[proc_macro_attribute]
pub fn needs(names: TokenStream, test: TokenStream) -> TokenStream {
    if !is_test(&test) {
        return error("`#[needs]` must stand above `#[test]`, which else overlooks `#[ignore]`");
    }
    let names = names.to_string();
    let mut reasons = Vec::new();
    for name in names.split(',').map(str::trim) {
        match NEEDS.iter().find(|need| need.0 == name) {
            None => return error(&format!("`{name}` must be scenes, gpu, browser or window")),
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

/// Expands to the folder of third-party scenes, as a string literal.
#[proc_macro]
pub fn third_party_scenes(_: TokenStream) -> TokenStream {
    TokenTree::from(Literal::string(env!("THIRD_PARTY_SCENES"))).into()
}

/// Whether the item still has the attribute `#[test]`, which is so if `#[needs]` stands above it.
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
