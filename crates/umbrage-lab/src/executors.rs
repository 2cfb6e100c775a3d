//! What there is to render with.

use crate::error::{Error, Field};
use crate::technique::NamedTechnique;
use umbrage::{Technique, Warp};
use umbrage_render::Gpu;

/// What shall render shadow maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backend {
    /// The GPU if there is one, else the reference.
    Auto,
    /// A GPU.
    Gpu,
    /// Rays on the CPU.
    Reference,
}

/// What there is to render with: the reference always, and a GPU or none.
pub struct Executors {
    gpu: Option<Gpu>,
    choice: Option<String>,
}

/// What reports call the two.
pub(crate) const GPU: &str = "gpu";
pub(crate) const REFERENCE: &str = "reference";

impl Executors {
    /// Opens what is asked for, for these techniques.
    ///
    /// # Errors
    /// A GPU that was asked for and is not there, or that cannot render one of the techniques.
    pub fn open(backend: Backend, techniques: &[NamedTechnique]) -> Result<Self, Error> {
        let log = techniques.iter().find(|t| !runs_on_gpu(t.technique()));
        let wrong = |problem: String| Err(Error::field(Field::Backend, problem));
        match backend {
            Backend::Reference => Ok(Self { gpu: None, choice: None }),
            Backend::Gpu => {
                if let Some(log) = log {
                    return wrong(format!(
                        "no GPU rasterises the rows of `{log}`; take reference or auto"
                    ));
                }
                match Gpu::open() {
                    Ok(gpu) => Ok(Self { gpu: Some(gpu), choice: None }),
                    Err(e) => wrong(format!("{e}; take reference")),
                }
            }
            Backend::Auto if log.is_some() && techniques.len() == 1 => Ok(Self {
                gpu: None,
                choice: Some("reference, on the CPU (no GPU rasterises `log`)".to_owned()),
            }),
            Backend::Auto => Ok(match Gpu::open() {
                Ok(gpu) => {
                    let software = if gpu.is_software() { ", in software" } else { "" };
                    let log = log.map_or(String::new(), |t| {
                        format!("; reference for `{t}`, which no GPU rasterises")
                    });
                    let choice = format!("gpu, {}{software}{log}", gpu.info().name);
                    Self { gpu: Some(gpu), choice: Some(choice) }
                }
                Err(e) => Self { gpu: None, choice: Some(format!("reference, on the CPU ({e})")) },
            }),
        }
    }

    /// What was chosen, a line to be told, if the choice was ours.
    pub fn choice(&self) -> Option<&str> {
        self.choice.as_deref()
    }

    /// The GPU, if there is one.
    pub(crate) fn gpu(&self) -> Option<&Gpu> {
        self.gpu.as_ref()
    }

    /// What renders whatever can be rendered so: `gpu` or `reference`.
    pub fn name(&self) -> &'static str {
        if self.gpu.is_some() { GPU } else { REFERENCE }
    }

    /// The GPU's own name, if there is one.
    pub fn device(&self) -> Option<String> {
        self.gpu.as_ref().map(|gpu| gpu.info().name.clone())
    }
}

/// Whether a GPU can render a technique: the rows of `log` bend.
pub(crate) fn runs_on_gpu(technique: &Technique) -> bool {
    technique.warp != Warp::Log
}
