//! Maps of all directions rendered live from a point that moves through a scene, beside how dense they are and how wrong.
//!
//! `octahedron_lab [SCENE] [--layout square|rectangle|cube] [--channel colour|distance|object] [--against rays|cube] [--texels N]
//! [--turn DEGREES] [--output FILE.png] [--camera NAME] [--exposure STOPS] [--size WxH] [--frames N] [--resize WxH] [--screenshot FILE]`
//!
//! Left: what the rasterizer sees in all directions, octant by octant or face by face, in about N × N texels. Middle: the solid angle of the
//! map's texels over the mean; red is too coarse, blue too fine. Right: the difference from a ray cast through the middle of each texel, or
//! from a cube map of as many texels looked up there. L, C and A change layout, channel and what the error is against; space holds the point.
//! With `--output` there is no window: the frames are made, and the last one is written.
//!
//! Source: T. Engelhardt, C. Dachsbacher, "Octahedron Environment Maps", VMV 2008.

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use clerestory::accel::bvh2::Bvh2;
use clerestory::accel::{NO_HIT, RayIndex};
use clerestory::film::PixelFormat;
use clerestory::gpu::shaders::types::SceneTriangle;
use clerestory::gpu::{Category, Gpu, GpuOptions};
use clerestory::maps::Texel;
use clerestory::raster::View;
use clerestory::scene::{self, Scene};
use clerestory::srgb::srgb_from_linear;
use clerestory::transport::GpuScene;
use clerestory::{Error, Result};
use clerestory_samples::arguments::Arguments;
use clerestory_samples::lettering;
use clerestory_samples::live_map::{Layout, Live, Seen};
use clerestory_samples::orbit::Orbit;
use clerestory_samples::panels::{DIVERGING, ERRORS, SEQUENTIAL, Scale, Sheet, color};
use clerestory_samples::window::{self, Show, Shown};
use glam::{DVec3, Vec3};
use winit::keyboard::{Key, NamedKey};

const SCENE: &str = "builtin:box-room";
/// Texels of the map are about this squared, unless told otherwise.
const TEXELS: u32 = 256;
/// Degrees that the point goes on each frame, unless told otherwise.
const TURN: f64 = 2.0;
/// Where on its way the point begins, rad: on no plane of symmetry.
const START: f64 = 0.6;
/// Size of a picture without a window.
const SIZE: [u32; 2] = [1200, 480];
/// How far the point goes from the middle of the scene, as a share of its extent, and where it is in height.
const ORBIT: DVec3 = DVec3::new(0.22, 0.08, 0.22);
/// Of surfaces without a material.
const GREY: Vec3 = Vec3::splat(0.5);
/// The least relative error that is shown, as a power of ten.
const LEAST_ERROR: f64 = -7.0;

fn main() -> ExitCode {
    clerestory_samples::report(run())
}

fn run() -> Result<()> {
    let own = ["--layout", "--channel", "--against", "--texels", "--turn", "--output"];
    let given = Arguments::of_process(&[&own[..], &window::Options::NAMES].concat(), 1)?;
    let choice = Choice {
        layout: Layout::ALL[one_of(&given, "--layout", Layout::ALL.map(Layout::name))?],
        channel: Channel::ALL[one_of(&given, "--channel", Channel::ALL.map(Channel::name))?],
        against_cube: one_of(&given, "--against", ["rays", "cube"])? == 1,
    };
    let texels = given.value("--texels")?.unwrap_or(TEXELS);
    if !(8..=2048).contains(&texels) {
        return Err(Error::setting("--texels", texels, "is not in 8 to 2048"));
    }
    let turn: f64 = given.value("--turn")?.unwrap_or(TURN);
    let Some(output) = given.text("--output") else {
        let options = window::Options::of(&given, SCENE)?;
        return window::show(options, |canvas| {
            Lab::new(
                canvas.gpu,
                canvas.scene,
                canvas.format,
                choice,
                texels,
                turn.to_radians(),
            )
        });
    };
    let scene = scene::load(given.alone(0).unwrap_or(SCENE))?;
    let gpu = Gpu::headless(&GpuOptions::default())?;
    let log = gpu.validation_log();
    let size = given.size("--size")?.unwrap_or(SIZE);
    let mut lab = Lab::new(&gpu, &scene, PixelFormat::Rgba8, choice, texels, turn.to_radians())?;
    let mut sheet = lab.next(size)?;
    for _ in 1..given.value("--frames")?.unwrap_or(1u32) {
        sheet = lab.next(size)?;
    }
    clerestory_samples::save_png(Path::new(output), size, &sheet.bytes(PixelFormat::Rgba8))?;
    println!("wrote {output}");
    lab.end();
    drop(lab);
    drop(gpu);
    clerestory_samples::check_messages(&log)
}

/// Which of some names an option has; the first without it.
fn one_of<const N: usize>(given: &Arguments, option: &str, names: [&str; N]) -> Result<usize> {
    let Some(name) = given.text(option) else {
        return Ok(0);
    };
    let unknown = || Error::setting(option, name, format!("is not one of {}", names.join(", ")));
    names.iter().position(|known| *known == name).ok_or_else(unknown)
}

/// What of the surfaces is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Channel {
    Colour,
    Distance,
    Object,
}

#[derive(Debug, Clone, Copy)]
struct Choice {
    layout: Layout,
    channel: Channel,
    against_cube: bool,
}

impl Channel {
    const ALL: [Self; 3] = [Self::Colour, Self::Distance, Self::Object];

    fn name(self) -> &'static str {
        match self {
            Self::Colour => "colour",
            Self::Distance => "distance",
            Self::Object => "object",
        }
    }
}

/// The next of all, and the first after the last.
fn after<T: Copy + PartialEq>(all: &[T], one: T) -> T {
    let at = all.iter().position(|other| *other == one).unwrap_or(0);
    all[(at + 1) % all.len()]
}

/// What the last frame was like.
#[derive(Debug, Clone, Copy, Default)]
struct Facts {
    texels: usize,
    /// Texels with another object.
    other: usize,
    /// Those of them that show nothing.
    empty: usize,
    /// Greatest relative error of the distance where the triangle is the same.
    distance: f64,
    milliseconds: f64,
}

struct Lab {
    gpu: Gpu,
    scene: GpuScene,
    triangles: Vec<SceneTriangle>,
    objects: Vec<u32>,
    /// By object.
    albedos: Vec<Vec3>,
    index: Bvh2,
    format: PixelFormat,
    choice: Choice,
    texels: u32,
    live: Live,
    cube: Option<Live>,
    angle: f64,
    turn: f64,
    held: bool,
    facts: Facts,
}

impl Lab {
    fn new(gpu: &Gpu, scene: &Scene, format: PixelFormat, choice: Choice, texels: u32, turn: f64) -> Result<Self> {
        let on_device = GpuScene::new(gpu, scene)?;
        let surfaces = on_device.surfaces();
        let triangles: Vec<SceneTriangle> = gpu.read(
            surfaces.set.scene_triangles.buffer().view(),
            surfaces.triangles as usize,
        )?;
        let corners: Vec<[Vec3; 3]> = triangles
            .iter()
            .map(|t| [t.a, t.b, t.c].map(Vec3::from_array))
            .collect();
        let mut objects = vec![NO_HIT; triangles.len()];
        for object in surfaces.objects {
            let range = object.triangles.start as usize..object.triangles.end as usize;
            objects[range].fill(object.object);
        }
        let albedos = scene.instances.iter().map(|instance| {
            let material = scene.meshes[instance.mesh as usize].material;
            match material.and_then(|index| scene.materials.get(index as usize)) {
                Some(lamp) if lamp.emission.max_element() > 0.0 => Vec3::ONE,
                Some(material) => material.base_color.truncate(),
                None => GREY,
            }
        });
        Ok(Self {
            gpu: gpu.clone(),
            live: Live::new(gpu, &on_device, choice.layout, texels)?,
            cube: None,
            albedos: albedos.collect(),
            index: Bvh2::build(&corners, &Default::default())?,
            scene: on_device,
            triangles,
            objects,
            format,
            choice,
            texels,
            angle: START,
            turn,
            held: false,
            facts: Facts::default(),
        })
    }

    /// Where the maps are seen from.
    fn origin(&self) -> Vec3 {
        let [lower, upper] = self.scene.surfaces().bounds;
        let (sin, cos) = self.angle.sin_cos();
        let share = 0.5 + ORBIT * DVec3::new(cos, (2.0 * self.angle).sin(), sin);
        lower + share.as_vec3() * (upper - lower)
    }

    /// Radiance of a surface lit from where it is seen and from one side, between 0 and 1.
    fn shade(&self, seen: Seen, direction: DVec3) -> Vec3 {
        const AMBIENT: f32 = 0.25;
        const SIDE: f32 = 0.4;
        const TOWARDS: Vec3 = Vec3::new(0.36, 0.8, 0.48);
        let Some(t) = self.triangles.get(seen.triangle as usize) else {
            return Vec3::ZERO;
        };
        let [a, b, c] = [t.a, t.b, t.c].map(Vec3::from_array);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let facing = normal.dot(direction.as_vec3()).abs();
        let side = normal.dot(TOWARDS).abs();
        let albedo = self.albedos.get(seen.object as usize).copied();
        albedo.unwrap_or(GREY) * (AMBIENT + SIDE * side + (1.0 - AMBIENT - SIDE) * facing)
    }

    fn shown(&self, seen: Seen, direction: DVec3, reach: f64) -> [u8; 3] {
        /// A step around the circle of hues that does not come back soon: the golden section.
        const HUE: f64 = 0.618_034;
        if seen.triangle == NO_HIT {
            return [12, 12, 16];
        }
        match self.choice.channel {
            Channel::Colour => self
                .shade(seen, direction)
                .to_array()
                .map(|value| (255.0 * srgb_from_linear(f64::from(value.clamp(0.0, 1.0)))).round() as u8),
            // Distances over two decades.
            Channel::Distance => color(SEQUENTIAL, 1.0 + 0.5 * (f64::from(seen.distance) / reach).log10()),
            Channel::Object => {
                let hue = (f64::from(seen.object) * HUE).fract() * 6.0;
                let facing = self.shade(seen, direction).max_element().sqrt();
                let channel = |shift: f64| {
                    let v = ((hue + shift).rem_euclid(6.0) - 3.0).abs() - 1.0;
                    (40.0 + 200.0 * v.clamp(0.0, 1.0) * f64::from(facing.clamp(0.4, 1.0))) as u8
                };
                [channel(0.0), channel(4.0), channel(2.0)]
            }
        }
    }

    /// How far apart two are, from 0 to 1.
    fn error(&self, seen: Seen, right: Seen, direction: DVec3) -> f64 {
        match self.choice.channel {
            Channel::Colour => {
                let off = self.shade(seen, direction) - self.shade(right, direction);
                f64::from(off.abs().max_element())
            }
            Channel::Object => f64::from(u8::from(seen.object != right.object)),
            Channel::Distance => relative(seen.distance, right.distance),
        }
    }

    /// The next frame.
    fn next(&mut self, size: [u32; 2]) -> Result<Sheet> {
        let begin = Instant::now();
        if self.live.layout != self.choice.layout {
            self.live = Live::new(&self.gpu, &self.scene, self.choice.layout, self.texels)?;
        }
        let origin = self.origin();
        let views = self.live.views(&self.scene, origin)?;
        let seen = self.live.render(&self.gpu, &self.scene, &views)?;
        let milliseconds = 1e3 * begin.elapsed().as_secs_f64();
        let map = self.live.layout.map();
        let directions: Vec<DVec3> = map
            .texels(self.live.size)
            .map(|texel| map.texel_direction(self.live.size, texel).unwrap_or(DVec3::Z))
            .collect();
        let right = if self.choice.against_cube {
            self.by_cube(origin, &directions)?
        } else {
            self.by_rays(&views, &directions)
        };
        self.facts = Facts {
            texels: seen.len(),
            other: seen.iter().zip(&right).filter(|(a, b)| a.object != b.object).count(),
            empty: seen
                .iter()
                .zip(&right)
                .filter(|(a, b)| a.triangle == NO_HIT && b.triangle != NO_HIT)
                .count(),
            distance: seen
                .iter()
                .zip(&right)
                .filter(|(a, b)| a.triangle == b.triangle)
                .map(|(a, b)| relative(a.distance, b.distance))
                .fold(0.0, f64::max),
            milliseconds,
        };
        let sheet = self.picture(size, &directions, &seen, &right);
        if !self.held {
            self.angle += self.turn;
        }
        Ok(sheet)
    }

    fn by_rays(&self, views: &[View], directions: &[DVec3]) -> Vec<Seen> {
        let texels = self.live.layout.map().texels(self.live.size);
        let cast = |(texel, direction): (Texel, &DVec3)| {
            let ray = self.live.ray(views, texel, *direction);
            let hit = self.index.closest_hit(&ray);
            let length = Vec3::from_array(ray.direction).length();
            Seen {
                triangle: hit.triangle,
                object: self.objects.get(hit.triangle as usize).copied().unwrap_or(NO_HIT),
                distance: if hit.triangle == NO_HIT {
                    f32::INFINITY
                } else {
                    hit.t * length
                },
            }
        };
        texels.zip(directions).map(cast).collect()
    }

    fn by_cube(&mut self, origin: Vec3, directions: &[DVec3]) -> Result<Vec<Seen>> {
        if self.cube.is_none() {
            self.cube = Some(Live::new(&self.gpu, &self.scene, Layout::Cube, self.texels)?);
        }
        let Some(cube) = &self.cube else {
            return Ok(Vec::new());
        };
        let views = cube.views(&self.scene, origin)?;
        let seen = cube.render(&self.gpu, &self.scene, &views)?;
        let nothing = Seen {
            triangle: NO_HIT,
            object: NO_HIT,
            distance: f32::INFINITY,
        };
        let held = |d: &DVec3| cube.at(*d).map_or(nothing, |texel| seen[cube.index(texel)]);
        Ok(directions.iter().map(held).collect())
    }

    fn picture(&self, size: [u32; 2], directions: &[DVec3], seen: &[Seen], right: &[Seen]) -> Sheet {
        let reach = f64::from(self.scene.surfaces().reach(self.origin()));
        let page = Page::new(size, &self.live);
        let mut sheet = Sheet::new(size, PAPER);
        let against = if self.choice.against_cube { "cube" } else { "rays" };
        let names = [
            format!("{}: {}", self.choice.channel.name(), self.live.layout.name()),
            "solid angle of texels".into(),
            format!("error against {against}"),
        ];
        let map = self.live.layout.map();
        page.panel(&mut sheet, 0, &names[0], |texel| {
            let at = self.live.index(texel);
            self.shown(seen[at], directions[at], reach)
        });
        page.panel(&mut sheet, 1, &names[1], |texel| {
            // Half of the mean to twice: the logarithm, white at the mean.
            let ratio = map.density_ratio(texel.centre(self.live.size));
            color(DIVERGING, 0.5 + 0.5 * ratio.log2())
        });
        page.panel(&mut sheet, 2, &names[2], |texel| {
            let at = self.live.index(texel);
            let error = self.error(seen[at], right[at], directions[at]);
            color(ERRORS, 1.0 - error.log10() / LEAST_ERROR)
        });
        if self.choice.channel == Channel::Distance {
            page.scale(&mut sheet, 0, SEQUENTIAL, ["near", "far"]);
        } else {
            let point = self.origin();
            page.line(&mut sheet, 0, &format!("{:.2} {:.2} {:.2}", point.x, point.y, point.z));
        }
        page.scale(&mut sheet, 1, DIVERGING, ["half", "twice"]);
        page.scale(&mut sheet, 2, ERRORS, [&format!("1e{LEAST_ERROR}"), "1"]);
        sheet
    }
}

/// |a − b| over b; 1 where only one is finite.
fn relative(a: f32, b: f32) -> f64 {
    match (a.is_finite(), b.is_finite()) {
        (true, true) => f64::from((a - b).abs() / b),
        (false, false) => 0.0,
        _ => 1.0,
    }
}

const PAPER: [u8; 3] = [24, 25, 30];
const INK: [u8; 3] = [225, 225, 220];

/// Where the three panels are.
struct Page<'a> {
    live: &'a Live,
    /// Pixels of a dot of letters.
    dot: u32,
    margin: u32,
    /// Of a panel.
    width: u32,
    /// Of the map in it, and where it begins.
    extent: [u32; 2],
    top: u32,
}

impl<'a> Page<'a> {
    fn new(size: [u32; 2], live: &'a Live) -> Self {
        let dot = (size[0] / 500).max(1);
        let margin = 8 * dot;
        let width = size[0].saturating_sub(4 * margin) / 3;
        // A line of words above and a scale below.
        let line = lettering::height(dot) + 2 * margin;
        let height = size[1].saturating_sub(2 * line);
        let (grid, _) = live.layout.faces();
        let shape = grid[0] as f32 * live.size.x as f32 / (grid[1] as f32 * live.size.y as f32);
        let across = (width as f32).min(height as f32 * shape);
        let extent = [across as u32, (across / shape) as u32];
        Self {
            live,
            dot,
            margin,
            width,
            extent,
            top: line + (height - extent[1].min(height)) / 2,
        }
    }

    fn left(&self, panel: u32) -> u32 {
        self.margin + panel * (self.width + self.margin)
    }

    fn panel(&self, sheet: &mut Sheet, panel: u32, name: &str, of: impl Fn(Texel) -> [u8; 3]) {
        let (grid, places) = self.live.layout.faces();
        let left = self.left(panel) + (self.width - self.extent[0].min(self.width)) / 2;
        let above = self.top.saturating_sub(lettering::height(self.dot) + self.margin);
        sheet.write(name, [self.left(panel), above], self.dot, INK);
        sheet.fill([left, self.top], self.extent, |share| {
            let p = [0, 1].map(|axis| share[axis] * f64::from(grid[axis]));
            let cell = p.map(|p| p as u32);
            let layer = places.iter().position(|place| *place == cell)? as u32;
            let within = |axis: usize, texels: u32| ((p[axis].fract() * f64::from(texels)) as u32).min(texels - 1);
            Some(of(Texel {
                layer,
                x: within(0, self.live.size.x),
                y: within(1, self.live.size.y),
            }))
        });
    }

    /// Below the panel.
    fn below(&self) -> u32 {
        self.top + self.extent[1] + self.margin
    }

    fn line(&self, sheet: &mut Sheet, panel: u32, text: &str) {
        sheet.write(text, [self.left(panel), self.below()], self.dot, INK);
    }

    /// A scale with names of its ends.
    fn scale(&self, sheet: &mut Sheet, panel: u32, scale: Scale, [from, to]: [&str; 2]) {
        let (left, top) = (self.left(panel), self.below());
        let [before, behind] = [from, to].map(|name| lettering::width(name, self.dot) + self.margin);
        sheet.write(from, [left, top], self.dot, INK);
        let right = left + self.width + self.margin;
        sheet.write(to, [right.saturating_sub(behind), top], self.dot, INK);
        let across = self.width.saturating_sub(before + behind);
        let extent = [across, lettering::height(self.dot)];
        sheet.fill([left + before, top], extent, |share| Some(color(scale, share[0])));
    }
}

impl Show for Lab {
    fn frame(&mut self, _: &mut Orbit, size: [u32; 2]) -> Result<Shown> {
        let begin = Instant::now();
        let bytes = self.next(size)?.bytes(self.format);
        let pixels = self.gpu.buffer_with("shown pixels", Category::Film, &bytes)?;
        Ok(Shown::since(begin, &pixels))
    }

    fn title(&mut self) -> String {
        let Facts {
            texels,
            other,
            empty,
            distance,
            milliseconds,
        } = self.facts;
        let against = if self.choice.against_cube { "the cube" } else { "rays" };
        format!(
            "{} of {texels} texels in {milliseconds:.1} ms; {other} with another object than {against}, {empty} of them empty, distances of equal triangles within {distance:.1e}",
            self.live.layout.name(),
        )
    }

    fn key(&mut self, key: &Key) {
        match key {
            Key::Named(NamedKey::Space) => self.held = !self.held,
            Key::Character(text) => match text.to_lowercase().as_str() {
                "l" => self.choice.layout = after(&Layout::ALL, self.choice.layout),
                "c" => self.choice.channel = after(&Channel::ALL, self.choice.channel),
                "a" => self.choice.against_cube = !self.choice.against_cube,
                _ => {}
            },
            _ => {}
        }
    }

    fn end(&mut self) {
        println!("last frame: {}", self.title());
    }
}
