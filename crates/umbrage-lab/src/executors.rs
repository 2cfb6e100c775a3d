//! The available executors: the CPU reference and, if there is one, a GPU.

use crate::error::{Error, Field};
use crate::technique::NamedTechnique;
use umbrage::{Technique, Warp};
use umbrage_render::Gpu;

/// The backend that renders shadow maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backend {
    /// The GPU if there is one and it can render the technique, otherwise the CPU reference.
    Auto,
    /// A GPU.
    Gpu,
    /// The CPU reference, which traces rays.
    Reference,
}

/// The available executors: always the CPU reference, and a GPU if one was opened.
pub struct Executors {
    gpu: Option<Gpu>,
    choice: String,
}

/// Names of the two backends in reports.
pub(crate) const GPU: &str = "gpu";
pub(crate) const REFERENCE: &str = "reference";

impl Executors {
    /// Opens the executors that the backend needs for these techniques.
    ///
    /// # Errors
    /// An error if a GPU was asked for and there is none, or if it cannot render one of the
    /// techniques.
    pub fn open(backend: Backend, techniques: &[NamedTechnique]) -> Result<Self, Error> {
        let unfit = techniques.iter().find_map(|t| Some((t, unfit_for_gpu(t.technique())?)));
        let wrong = |problem: String| Err(Error::field(Field::Backend, problem));
        match backend {
            Backend::Reference => {
                Ok(Self { gpu: None, choice: "reference, on the CPU".to_owned() })
            }
            Backend::Gpu => {
                if let Some((technique, reason)) = unfit {
                    return wrong(format!("`{technique}`: {reason}; take reference or auto"));
                }
                match Gpu::open() {
                    Ok(gpu) => Ok(Self { choice: described(&gpu), gpu: Some(gpu) }),
                    Err(e) => wrong(format!("{e}; take reference")),
                }
            }
            Backend::Auto => Ok(match unfit {
                Some((_, reason)) if techniques.len() == 1 => {
                    Self { gpu: None, choice: format!("reference, on the CPU ({reason})") }
                }
                _ => match Gpu::open() {
                    Ok(gpu) => {
                        let by_reference = unfit.map_or(String::new(), |(technique, reason)| {
                            format!("; reference for `{technique}` ({reason})")
                        });
                        let choice = described(&gpu) + &by_reference;
                        Self { gpu: Some(gpu), choice }
                    }
                    Err(e) => Self { gpu: None, choice: format!("reference, on the CPU ({e})") },
                },
            }),
        }
    }

    /// Returns the executors of a program that has opened a GPU itself, such as one with a window.
    pub fn with_gpu(gpu: Gpu) -> Self {
        Self { choice: described(&gpu), gpu: Some(gpu) }
    }

    /// Returns a line that tells the user what renders.
    pub fn choice(&self) -> &str {
        &self.choice
    }

    /// Returns the GPU, if one was opened.
    pub(crate) fn gpu(&self) -> Option<&Gpu> {
        self.gpu.as_ref()
    }

    /// Returns `gpu` if a GPU was opened, even if it cannot render every technique, else
    /// `reference`.
    pub fn name(&self) -> &'static str {
        if self.gpu.is_some() { GPU } else { REFERENCE }
    }

    /// Returns the name of the GPU itself, if one was opened.
    pub fn device(&self) -> Option<String> {
        self.gpu.as_ref().map(|gpu| gpu.info().name.clone())
    }
}

/// Tells which GPU it is.
fn described(gpu: &Gpu) -> String {
    let software = if gpu.is_software() { ", in software" } else { "" };
    format!("gpu, {}{software}", gpu.info().name)
}

/// Returns why no GPU can render the technique; `None` if one can.
pub fn unfit_for_gpu(technique: &Technique) -> Option<&'static str> {
    (technique.warp == Warp::Log).then_some("no GPU rasterises bent rows")
}
