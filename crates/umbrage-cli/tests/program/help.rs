use crate::desk::Desk;

#[test]
fn every_command_has_help_with_an_example() {
    let desk = Desk::new();
    for command in [
        &[][..],
        &["render"],
        &["compare"],
        &["sweep"],
        &["plan"],
        &["prepare"],
        &["info"],
        &["completions"],
        &["scenes"],
        &["theory"],
        &["bench"],
        &["devices"],
        &["help"],
    ] {
        for flag in ["--help", "-h"] {
            let args = [command, &[flag]].concat();
            let run = desk.run(&args);
            assert_eq!((run.code, run.stderr.as_str()), (0, ""), "{args:?}");
            let example = format!("umbrage {}", command.join(" "));
            let examples = run.stdout.split("Examples:").nth(1).unwrap_or_default();
            assert!(examples.contains(example.trim()), "{args:?}: {}", run.stdout);
            assert!(
                run.stdout.lines().all(|l| l.chars().count() <= 120),
                "{args:?}: {}",
                run.stdout
            );
        }
    }
}

/// The language stands in one place, and every command's help points there.
#[test]
fn help_has_topics() {
    let desk = Desk::new();
    let language = desk.succeed(&["help", "shadows"]);
    for word in ["pcfN", "+zK", "lambda=NUMBER", "(blur=WIDTH)", "cascades", "@TEXELS"] {
        assert!(language.contains(word), "{word}: {language}");
    }
    for command in ["render", "compare", "sweep", "plan", "bench"] {
        let own = desk.succeed(&[command, "--help"]);
        assert_eq!(desk.succeed(&["help", command]), own);
        let words = own.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(words.contains("umbrage help shadows"), "{command}: {own}");
        assert!(!own.contains("evsm"), "{command} repeats the language: {own}");
    }
    assert_eq!(desk.succeed(&["help"]), desk.succeed(&["--help"]));
    let run = desk.run(&["help", "rendr"]);
    assert!(run.code != 0 && run.stderr.contains("rendr"), "{}", run.stderr);
}

#[test]
fn the_version_is_the_packages() {
    assert_eq!(
        Desk::new().succeed(&["--version"]),
        concat!("umbrage ", env!("CARGO_PKG_VERSION"), "\n")
    );
}

#[test]
fn examples_of_the_help_parse() {
    // What needs no file of the user's must run as printed; the rest must be understood up to that.
    let desk = Desk::new();
    for command in [
        "render", "compare", "sweep", "plan", "prepare", "info", "scenes", "theory", "bench",
        "devices",
    ] {
        let help = desk.succeed(&[command, "--help"]);
        let examples = help.split("Examples:").nth(1).unwrap().replace("\\\n", " ");
        for example in examples.lines().map(str::trim).filter(|l| l.starts_with("umbrage")) {
            let words: Vec<&str> = example.split_whitespace().skip(1).collect();
            let needs_file = words.iter().any(|w| w.ends_with(".glb") || w.ends_with(".json"));
            let is_long = ["compare", "render", "bench", "prepare"].contains(&command);
            if needs_file {
                let run = desk.run(&words);
                let understood = ["there is no file", "No such file"];
                assert!(
                    understood.iter().any(|u| run.stderr.contains(u)),
                    "{example}: {}",
                    run.stderr
                );
            } else if !is_long {
                desk.succeed(&words);
            }
        }
    }
}
