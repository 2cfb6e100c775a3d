//! What all window examples share: options, the window and its title, keys, and pictures.
//!
//! The title shows the state, because these examples are built without Bevy's text.

use bevy::diagnostic::{DiagnosticsStore, FrameTimeDiagnosticsPlugin};
use bevy::ecs::system::SystemParam;
use bevy::light::{DirectionalLightShadowMap, ShadowFilteringMethod};
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured};
use bevy::time::TimeUpdateStrategy;
use bevy::window::PrimaryWindow;
use bevy::winit::WinitSettings;
use bevy_umbrage::ShadowsError;
use bevy_umbrage::prelude::*;
use std::fmt::Display;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

const OPTIONS: &str = "\
Options:
  --shadows CHOICE        start with none, default or a technique such as adaptive+z4
  --off                   start with Bevy's own shadows
  --debug MODE            start with off, cascades, density or grid
  --filter FILTER         start with hardware2x2, gaussian (if not told) or temporal
  --map-size TEXELS       width and height of each map of sun and spot lights; 2048 if not told
  --screenshot FILE.png   save a picture of the window, and exit
  --frames N              how many frames, of 1/60 s each, to draw before that; 30 if not told";

const KEYS: &str = "\
Keys:
  SPACE      Umbrage on or off
  P, 1 to 9  next choice of shadows, or the choice of this number
  D          next debug mode
  F          next filter";

const DEBUG_MODES: [(&str, UmbrageDebug); 4] = [
    ("off", UmbrageDebug::Off),
    ("cascades", UmbrageDebug::Cascades),
    ("density", UmbrageDebug::TexelDensity),
    ("grid", UmbrageDebug::TexelGrid),
];

const FILTERS: [(&str, ShadowFilteringMethod); 3] = [
    ("gaussian", ShadowFilteringMethod::Gaussian),
    ("hardware2x2", ShadowFilteringMethod::Hardware2x2),
    ("temporal", ShadowFilteringMethod::Temporal),
];

const DIGITS: [KeyCode; 9] = [
    KeyCode::Digit1,
    KeyCode::Digit2,
    KeyCode::Digit3,
    KeyCode::Digit4,
    KeyCode::Digit5,
    KeyCode::Digit6,
    KeyCode::Digit7,
    KeyCode::Digit8,
    KeyCode::Digit9,
];

/// The options of the command line. Whoever knows an option takes it; what is left is an error.
pub(crate) struct Arguments(Vec<String>);

impl Arguments {
    pub(crate) fn new() -> Self {
        Arguments(std::env::args_os().skip(1).map(|a| a.to_string_lossy().into()).collect())
    }

    /// Takes the option `name` and the value behind it.
    pub(crate) fn value<T: FromStr<Err: Display>>(&mut self, name: &str) -> Option<T> {
        let at = self.0.iter().position(|argument| argument == name)?;
        self.0.remove(at);
        if at == self.0.len() {
            fail(format!("{name} needs a value"));
        }
        let text = self.0.remove(at);
        Some(text.parse().unwrap_or_else(|error| fail(format!("{name} {text}: {error}"))))
    }

    /// Takes the option `name`, which has no value.
    pub(crate) fn flag(&mut self, name: &str) -> bool {
        let at = self.0.iter().position(|argument| argument == name);
        at.map(|at| self.0.remove(at)).is_some()
    }

    fn finish(self) {
        if let Some(argument) = self.0.first() {
            fail(format!("{argument} is no option, or is given twice; --help lists the options"));
        }
    }
}

/// Ends the program because its options are wrong.
pub(crate) fn fail(message: impl Display) -> ! {
    eprintln!("error: {message}");
    std::process::exit(2)
}

/// What an example is called, and what it adds to the options and keys of all.
pub(crate) struct Example {
    pub(crate) name: &'static str,
    /// Lines for further options.
    pub(crate) options: &'static [&'static str],
    /// Lines for further keys.
    pub(crate) keys: &'static [&'static str],
    /// The shadows to choose among: `none`, `default`, or a technique.
    pub(crate) shadows: &'static [&'static str],
}

impl Example {
    /// An app with a window, Umbrage, and the keys above; the scene is the example's own.
    pub(crate) fn app(self, mut arguments: Arguments) -> App {
        if arguments.flag("--help") {
            println!("{OPTIONS}{}\n\n{KEYS}{}", self.options.concat(), self.keys.concat());
            std::process::exit(0);
        }
        let shadows = self.shadows.iter().map(|text| Choice::from_str(text).expect(text));
        let mut settings = Settings {
            name: self.name,
            shadows: shadows.collect(),
            choice: 0,
            filter: arguments.value("--filter").map_or(0, |name| place(&FILTERS, "--filter", name)),
        };
        if let Some(choice) = arguments.value::<Choice>("--shadows") {
            settings.choice = settings.place_of(choice);
        }
        let enabled = !arguments.flag("--off");
        let debug =
            arguments.value("--debug").map_or(0, |name| place(&DEBUG_MODES, "--debug", name));
        let size = arguments.value("--map-size").unwrap_or(2048_usize);
        if !size.is_power_of_two() || size > 8192 {
            fail(format!("--map-size {size}: a power of two up to 8192 is needed"));
        }
        let picture = picture(&mut arguments);
        arguments.finish();
        println!("{KEYS}{}", self.keys.concat());

        let window = Window { title: self.name.into(), resolution: (960, 540).into(), ..default() };
        let mut app = App::new();
        app.add_plugins(
            DefaultPlugins.set(WindowPlugin { primary_window: Some(window), ..default() }).set(
                // A picture must not be taken before there are pipelines to draw with.
                RenderPlugin { synchronous_pipeline_compilation: picture.is_some(), ..default() },
            ),
        )
        .add_plugins((UmbragePlugin, FrameTimeDiagnosticsPlugin::default()))
        .insert_resource(UmbrageEnabled(enabled))
        .insert_resource(DEBUG_MODES[debug].1)
        .insert_resource(DirectionalLightShadowMap { size })
        .insert_resource(settings)
        .init_resource::<Shapes>()
        .add_systems(Update, (keys, apply.run_if(resource_changed::<Settings>), title).chain());
        if let Some(picture) = picture {
            app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs(1) / 60))
                .insert_resource(WinitSettings::continuous())
                .insert_resource(picture)
                .add_systems(Last, take_picture);
        }
        app
    }
}

/// The place of a name in a table, or the end of the program.
fn place<T>(table: &[(&str, T)], option: &str, name: String) -> usize {
    table.iter().position(|(known, _)| *known == name).unwrap_or_else(|| {
        let known: Vec<&str> = table.iter().map(|(known, _)| *known).collect();
        fail(format!("{option} {name}: one of {} is needed", known.join(", ")))
    })
}

/// Shadows as they are asked for; `none` leaves Bevy's own cascades.
struct Choice {
    name: String,
    shadows: Option<UmbrageShadows>,
}

impl FromStr for Choice {
    type Err = ShadowsError;

    fn from_str(text: &str) -> Result<Self, ShadowsError> {
        let shadows = match text {
            "none" => None,
            "default" => Some(UmbrageShadows::default()),
            technique => Some(technique.parse()?),
        };
        Ok(Choice { name: text.into(), shadows })
    }
}

#[derive(Resource)]
struct Settings {
    name: &'static str,
    shadows: Vec<Choice>,
    choice: usize,
    filter: usize,
}

impl Settings {
    /// The place of a choice among the others, where it comes last if it was not there.
    fn place_of(&mut self, choice: Choice) -> usize {
        let place = self.shadows.iter().position(|known| known.name == choice.name);
        place.unwrap_or_else(|| {
            self.shadows.push(choice);
            self.shadows.len() - 1
        })
    }
}

fn keys(
    keys: Res<ButtonInput<KeyCode>>,
    mut settings: ResMut<Settings>,
    mut enabled: ResMut<UmbrageEnabled>,
    mut debug: ResMut<UmbrageDebug>,
) {
    if keys.just_pressed(KeyCode::Space) {
        enabled.0 = !enabled.0;
    }
    if keys.just_pressed(KeyCode::KeyD) {
        *debug = DEBUG_MODES[(debug_mode(*debug) + 1) % DEBUG_MODES.len()].1;
    }
    if keys.just_pressed(KeyCode::KeyF) {
        settings.filter = (settings.filter + 1) % FILTERS.len();
    }
    if keys.just_pressed(KeyCode::KeyP) {
        settings.choice = (settings.choice + 1) % settings.shadows.len();
    }
    let digit = DIGITS.iter().position(|digit| keys.just_pressed(*digit));
    if let Some(digit) = digit.filter(|digit| *digit < settings.shadows.len()) {
        settings.choice = digit;
    }
}

fn debug_mode(debug: UmbrageDebug) -> usize {
    DEBUG_MODES.iter().position(|(_, mode)| *mode == debug).unwrap_or(0)
}

/// Gives suns and cameras what was chosen.
fn apply(
    mut commands: Commands,
    settings: Res<Settings>,
    suns: Query<Entity, With<DirectionalLight>>,
    cameras: Query<Entity, With<Camera3d>>,
) {
    for sun in suns {
        match &settings.shadows[settings.choice].shadows {
            Some(shadows) => commands.entity(sun).insert(shadows.clone()),
            None => commands.entity(sun).remove::<UmbrageShadows>(),
        };
    }
    for camera in cameras {
        commands.entity(camera).insert(FILTERS[settings.filter].1);
    }
}

fn title(
    mut window: Single<&mut Window, With<PrimaryWindow>>,
    settings: Res<Settings>,
    debug: Res<UmbrageDebug>,
    status: Res<UmbrageStatus>,
    diagnostics: Res<DiagnosticsStore>,
) {
    let fps = diagnostics
        .get(&FrameTimeDiagnosticsPlugin::FPS)
        .and_then(bevy::diagnostic::Diagnostic::smoothed);
    let lookup = match &status.lookup {
        Lookup::Waiting => "waiting",
        Lookup::Umbrage => "on",
        Lookup::Bevy => "off",
        Lookup::Refused { why } => why,
    };
    let title = format!(
        "{}: Umbrage {lookup}, shadows {}, {}, debug {}, {:.0} fps, planning {:.2} ms",
        settings.name,
        settings.shadows[settings.choice].name,
        FILTERS[settings.filter].0,
        DEBUG_MODES[debug_mode(*debug)].0,
        fps.unwrap_or(0.0),
        status.planning.as_secs_f64() * 1e3,
    );
    // Windows take note of every write to their title.
    if window.title != title {
        window.title = title;
    }
}

/// A picture to be taken after so many frames.
#[derive(Resource)]
struct Picture {
    file: PathBuf,
    frames: u32,
}

fn picture(arguments: &mut Arguments) -> Option<Picture> {
    let frames = arguments.value("--frames");
    let Some(file) = arguments.value::<PathBuf>("--screenshot") else {
        if frames.is_some() {
            fail("--frames goes with --screenshot");
        }
        return None;
    };
    if !file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png")) {
        fail(format!("--screenshot {}: the name of a file .png is needed", file.display()));
    }
    let frames = frames.unwrap_or(30);
    if frames == 0 {
        fail("--frames 0: at least one is needed");
    }
    Some(Picture { file, frames })
}

fn take_picture(mut commands: Commands, picture: Res<Picture>, mut frame: Local<u32>) {
    *frame += 1;
    if *frame == picture.frames {
        commands.spawn(Screenshot::primary_window()).observe(save_picture);
    }
}

fn save_picture(
    captured: On<ScreenshotCaptured>,
    picture: Res<Picture>,
    window: Single<&Window, With<PrimaryWindow>>,
    mut exit: MessageWriter<AppExit>,
) {
    let pixels = captured.image.clone().try_into_dynamic().map_err(|error| error.to_string());
    let saved = pixels
        .and_then(|pixels| pixels.to_rgb8().save(&picture.file).map_err(|error| error.to_string()));
    exit.write(match saved {
        Ok(()) => {
            println!("{} shows {}", picture.file.display(), window.title);
            AppExit::Success
        }
        Err(error) => {
            eprintln!("error: {}: {error}", picture.file.display());
            AppExit::error()
        }
    });
}

/// Unit shapes that everything in the scenes is made of by scaling, so that few meshes are drawn.
#[derive(Resource)]
pub(crate) struct Shapes {
    cube: Handle<Mesh>,
    cylinder: Handle<Mesh>,
    ball: Handle<Mesh>,
}

impl FromWorld for Shapes {
    fn from_world(world: &mut World) -> Self {
        let mut meshes = world.resource_mut::<Assets<Mesh>>();
        Shapes {
            cube: meshes.add(Cuboid::new(1.0, 1.0, 1.0)),
            cylinder: meshes.add(Cylinder::new(1.0, 1.0).mesh().resolution(16)),
            ball: meshes.add(Sphere::new(1.0).mesh().uv(20, 12)),
        }
    }
}

/// Builds scenes from shapes in plain colours.
#[derive(SystemParam)]
pub(crate) struct Builder<'w, 's> {
    pub(crate) commands: Commands<'w, 's>,
    shapes: Res<'w, Shapes>,
    materials: ResMut<'w, Assets<StandardMaterial>>,
}

/// A colour that shapes can share.
pub(crate) type Paint = MeshMaterial3d<StandardMaterial>;

impl Builder<'_, '_> {
    /// A rough surface of this colour in sRGB.
    pub(crate) fn paint(&mut self, red: f32, green: f32, blue: f32) -> Paint {
        MeshMaterial3d(self.materials.add(StandardMaterial {
            base_color: Color::srgb(red, green, blue),
            perceptual_roughness: 0.9,
            ..default()
        }))
    }

    /// A box by the middle of its bottom and by its size, metres.
    pub(crate) fn block(&mut self, paint: &Paint, bottom: Vec3, size: Vec3) -> Entity {
        let transform =
            Transform::from_translation(bottom + Vec3::Y * size.y / 2.0).with_scale(size);
        self.shape(self.shapes.cube.clone(), paint, transform)
    }

    /// A bar that is round, from one end to the other, metres.
    pub(crate) fn bar(&mut self, paint: &Paint, from: Vec3, to: Vec3, radius: f32) -> Entity {
        let along = to - from;
        let transform = Transform::from_translation((from + to) / 2.0)
            .with_rotation(Quat::from_rotation_arc(Vec3::Y, along.normalize()))
            .with_scale(Vec3::new(radius, along.length(), radius));
        self.shape(self.shapes.cylinder.clone(), paint, transform)
    }

    pub(crate) fn ball(&mut self, paint: &Paint, centre: Vec3, radius: f32) -> Entity {
        let transform = Transform::from_translation(centre).with_scale(Vec3::splat(radius));
        self.shape(self.shapes.ball.clone(), paint, transform)
    }

    fn shape(&mut self, mesh: Handle<Mesh>, paint: &Paint, transform: Transform) -> Entity {
        self.commands.spawn((Mesh3d(mesh), paint.clone(), transform)).id()
    }
}
