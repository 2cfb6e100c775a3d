//! Options of the command line, as `--name value` or `--name=value`.

use bevy::math::Vec3;
use std::process::ExitCode;

/// Why a program ends: what the user asked for cannot be, or it failed.
pub(crate) enum Problem {
    Usage(String),
    Failure(String),
}

/// Ends the program, with one line about what is wrong, if anything is.
pub(crate) fn end(result: Result<(), Problem>) -> ExitCode {
    let (message, code) = match result {
        Ok(()) => return ExitCode::SUCCESS,
        Err(Problem::Usage(message)) => (message + " (see --help)", 2),
        Err(Problem::Failure(message)) => (message, 1),
    };
    eprintln!("error: {}", message.split_whitespace().collect::<Vec<_>>().join(" "));
    ExitCode::from(code)
}

/// The given options, and the words that are not options.
pub(crate) struct Options {
    given: Vec<(String, String)>,
    pub(crate) words: Vec<String>,
}

impl Options {
    /// Reads the command line. Prints `usage` and ends the program where `--help` is asked for.
    pub(crate) fn of_command_line(known: &[&str], usage: &str) -> Result<Self, Problem> {
        let (mut given, mut words) = (Vec::new(), Vec::new());
        // What is no Unicode is no option, and no name that is known either.
        let mut left = std::env::args_os().skip(1).map(|a| a.to_string_lossy().into_owned());
        while let Some(word) = left.next() {
            let Some(name) = word.strip_prefix("--") else {
                words.push(word);
                continue;
            };
            let (name, value) = match name.split_once('=') {
                Some((name, value)) => (name, Some(value.to_owned())),
                None => (name, None),
            };
            if name == "help" {
                println!("{usage}");
                std::process::exit(0)
            }
            if !known.contains(&name) {
                return Err(Problem::Usage(format!("unknown option --{name}")));
            }
            let Some(value) = value.or_else(|| left.next()) else {
                return Err(Problem::Usage(format!("--{name} needs a value")));
            };
            given.push((name.to_owned(), value));
        }
        Ok(Self { given, words })
    }

    /// All values of an option.
    pub(crate) fn all(&self, name: &str) -> impl Iterator<Item = &str> {
        self.given.iter().filter(move |(n, _)| n == name).map(|(_, value)| value.as_str())
    }

    /// The value of an option, the last one if there are several.
    pub(crate) fn text(&self, name: &str) -> Option<&str> {
        self.all(name).last()
    }

    pub(crate) fn needed(&self, name: &str) -> Result<&str, Problem> {
        self.text(name).ok_or_else(|| Problem::Usage(format!("--{name} is missing")))
    }

    /// A finite number; `None` if it is not given.
    pub(crate) fn number(&self, name: &str) -> Result<Option<f32>, Problem> {
        self.text(name).map(|text| number(name, text)).transpose()
    }

    pub(crate) fn needed_number(&self, name: &str) -> Result<f32, Problem> {
        number(name, self.needed(name)?)
    }

    /// A whole number in a range; `None` if it is not given.
    pub(crate) fn whole(
        &self,
        name: &str,
        least: usize,
        most: usize,
    ) -> Result<Option<usize>, Problem> {
        let Some(text) = self.text(name) else { return Ok(None) };
        match text.parse() {
            Ok(value) if (least..=most).contains(&value) => Ok(Some(value)),
            _ => {
                Err(wrong(name, &format!("must be a whole number, {least} to {most}, is {text:?}")))
            }
        }
    }

    pub(crate) fn needed_vector(&self, name: &str) -> Result<Vec3, Problem> {
        let text = self.needed(name)?;
        let parts: Vec<f32> = text.split(',').map(|p| number(name, p)).collect::<Result<_, _>>()?;
        match parts[..] {
            [x, y, z] => Ok(Vec3::new(x, y, z)),
            _ => Err(wrong(name, &format!("must be x,y,z, is {text:?}"))),
        }
    }
}

/// A value that an option cannot have.
pub(crate) fn wrong(name: &str, problem: &str) -> Problem {
    Problem::Usage(format!("--{name}: {problem}"))
}

fn number(name: &str, text: &str) -> Result<f32, Problem> {
    match text.trim().parse::<f32>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(wrong(name, &format!("must be a finite number, is {text:?}"))),
    }
}
