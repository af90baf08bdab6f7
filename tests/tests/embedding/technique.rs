//! A technique that a host writes: it renders into the engine's film, and is refused where device or scene do not fit.

use std::collections::BTreeMap;

use clerestory::film::{GpuFilm, NonFiniteSamples, Picture, PixelFormat, Step};
use clerestory::gpu::shaders::film::add_frame;
use clerestory::gpu::shaders::types::{FilmPixel, TwoFloat};
use clerestory::gpu::{
    Access, Buffer, BufferDesc, Category, ComputePipeline, EnabledFeatures, Gpu, PipelineInfo, Recorder,
};
use clerestory::render::{RenderOptions, Rendered, Renderer};
use clerestory::scene::Camera;
use clerestory::settings::{Settings, SettingsDecl};
use clerestory::techniques::{
    Accumulated, Bias, Card, Foresight, Frame, FrameMethod, FrameTarget, PathTracerSettings, Skipped, Technique, View,
};
use clerestory::transport::PathSet;
use clerestory::transport::random::{pcg4d, unit_float};
use clerestory::{Error, Result};
use clerestory_hard_cases::{Subject, Verdict, judge};
use clerestory_tests::shaders::host_frame;
use clerestory_tests::{assert_no_messages, gpu};
use glam::UVec4;

use crate::Host;

clerestory::settings! {
    /// Settings as a host would declare them.
    pub struct EvenSettings {
        /// Radiance of every sample.
        pub radiance: f32 = 1.0, in 0.0.., unit "W·m⁻²·sr⁻¹";
    }
}

/// A technique as a host would write it: every sample of every pixel has the radiance that its settings name.
struct Even {
    gpu: Gpu,
    film: GpuFilm,
    radiance: f32,
    samples: u32,
}

const EVEN: Card = Card {
    id: "even",
    summary: "the same radiance everywhere",
    rows: &[],
    bias: Bias::Biased("looks at nothing"),
    needs: &[],
    kernels: &[],
    path_set: PathSet::ALL,
    refusals: |profile| {
        let lit = !profile.has_environment();
        lit.then(|| "there is no sky".to_owned()).into_iter().collect()
    },
    settings: SettingsDecl::of::<EvenSettings>(),
    variants: &[],
    foresight: Foresight::PLAIN,
    create: |gpu, _, view, settings| {
        let settings: EvenSettings = settings.read()?;
        Ok(Box::new(Even {
            gpu: gpu.clone(),
            film: GpuFilm::new(gpu, view.size, view.aovs)?,
            radiance: settings.radiance,
            samples: 0,
        }))
    },
};

/// A frame method as a host would write it: pictures whose pixels are their places and a random number.
struct Places {
    pipeline: ComputePipeline<host_frame::Kernel>,
    /// Passes of a frame beside the one that draws.
    idle: u32,
    begun: u64,
    drawn: u64,
}

const PLACES: Card = Card {
    id: "places",
    summary: "every pixel shows its place and a random number",
    path_set: PathSet::EMITTED,
    refusals: |_| Vec::new(),
    settings: SettingsDecl::NONE,
    foresight: Foresight::FRAMES,
    create: |gpu, _, view, _| places_with(gpu, view, 0),
    ..EVEN
};

fn places_with(gpu: &Gpu, view: &View<'_>, idle: u32) -> Result<Box<dyn Technique>> {
    let method = Places {
        pipeline: gpu.compute_pipeline(&())?,
        idle,
        begun: 0,
        drawn: 0,
    };
    Accumulated::boxed(gpu, view, method)
}

impl FrameMethod for Places {
    fn begin(&mut self, _: &mut Recorder) -> Result<()> {
        self.begun += 1;
        Ok(())
    }

    fn record(&mut self, recorder: &mut Recorder, frame: &Frame<'_>, target: &FrameTarget<'_>) -> Result<()> {
        self.drawn += 1;
        let (pixels, [width, height]) = (target.pixels()?, target.size);
        for _ in 0..self.idle {
            recorder.pass("places: nothing", |_| Ok(()))?;
        }
        let push = host_frame::Push {
            width,
            height,
            seed: frame.seed,
            frame: frame.number,
        };
        recorder.pass("places: draw", |pass| {
            let set = host_frame::Set0 {
                radiance: target.radiance.view(),
            };
            let groups = self.pipeline.groups_over(pixels);
            pass.dispatch(&self.pipeline, &[&set], &push, groups)
        })
    }

    fn path_set(&self) -> PathSet {
        PathSet::EMITTED
    }

    fn counters(&self) -> BTreeMap<&'static str, u64> {
        BTreeMap::from([("begun", self.begun), ("drawn", self.drawn)])
    }

    fn pipelines(&self) -> Vec<PipelineInfo> {
        vec![self.pipeline.info()]
    }
}

impl Technique for Even {
    fn step(&mut self, samples: u32) -> Result<Option<Step>> {
        if self.samples >= samples {
            return Ok(None);
        }
        self.samples += 1;
        let times = |x: f32| TwoFloat {
            hi: x * self.samples as f32,
            lo: 0.0,
        };
        let pixel = FilmPixel {
            sum: [times(self.radiance); 3],
            square: [times(self.radiance * self.radiance); 3],
            samples: self.samples,
            nan_samples: 0,
            infinite_samples: 0,
        };
        let mut timings = Vec::new();
        let mut pixels = 0;
        for band in self.film.bands() {
            let sums = vec![pixel; band.pixels() as usize];
            let bytes = size_of_val(sums.as_slice()) as u64;
            let staging = self.gpu.buffer(&BufferDesc::upload("even", bytes))?;
            staging.write(0, &sums)?;
            let mut recorder = self.gpu.recorder("even")?;
            recorder.pass("even: fill", |pass| {
                pass.copy(staging.slice(0, bytes), band.set().film_pixels)?;
                pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
                Ok(())
            })?;
            timings.push(recorder.submit()?.wait()?);
            pixels += u64::from(band.pixels());
        }
        Ok(Some(Step {
            timings,
            done: pixels * u64::from(self.samples),
            wanted: pixels * u64::from(samples),
        }))
    }

    fn picture(&mut self) -> Result<(Picture, NonFiniteSamples)> {
        self.film.picture()
    }

    fn display(&mut self, target: &Buffer, exposure: f32, format: PixelFormat) -> Result<()> {
        self.film.display(target, exposure, format)
    }

    fn set_camera(&mut self, _: &Camera) -> Result<()> {
        self.samples = 0;
        self.film.clear()
    }

    fn path_set(&self) -> PathSet {
        PathSet::ALL
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::json!({"radiance": self.radiance})
    }

    fn counters(&self) -> BTreeMap<&'static str, u64> {
        BTreeMap::new()
    }

    fn pipelines(&self) -> Vec<PipelineInfo> {
        Vec::new()
    }

    fn skipped(&self) -> Vec<Skipped> {
        Vec::new()
    }
}

#[test]
fn a_technique_of_the_hosts_own_renders_into_the_same_film() {
    let gpu = gpu();
    let scene = clerestory::scene::load("builtin:box-city?n=2").unwrap();
    let renderer = Renderer::new(&gpu, &scene).unwrap();
    let options = RenderOptions {
        size: [5, 3],
        spp: 4,
        settings: EvenSettings { radiance: 0.25 }.into(),
        ..RenderOptions::default()
    };
    let mut rendering = renderer.start_technique(&EVEN, &options).unwrap();
    while rendering.step().unwrap().is_some() {}
    let screen = gpu
        .buffer(&BufferDesc::storage("screen", 4 * 15, Category::Film))
        .unwrap();
    rendering.display(&screen, 2.0, PixelFormat::Rgba8).unwrap();
    assert_eq!(gpu.read::<u32>(screen.view(), 15).unwrap(), [u32::MAX; 15]);
    let small = gpu.buffer(&BufferDesc::storage("small", 56, Category::Film)).unwrap();
    let error = rendering
        .display(&small, 0.0, PixelFormat::Rgba8)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("small") && error.contains("56") && error.contains("60"),
        "{error}"
    );
    let rendered = rendering.finish().unwrap();
    assert_eq!(rendered.picture.layer("radiance").unwrap().values(), [0.25; 45]);
    assert_eq!(rendered.picture.layer("variance").unwrap().values(), [0.0; 45]);
    assert_eq!(rendered.report.technique, "even");
    assert_eq!(rendered.report.samples, [4, 4]);
    assert!(
        rendered
            .report
            .passes
            .iter()
            .any(|pass| pass.name == "even: fill" && pass.count == 4)
    );
    assert_no_messages(&gpu);
}

/// What the kernel draws of a pixel, in the order of the frames.
fn places([width, height]: [u32; 2], seed: u32, frames: u32) -> Vec<[f32; 3]> {
    let mean = |pixel: u32| {
        let numbers = (0..frames).map(|frame| unit_float(pcg4d(UVec4::new(pixel, frame, 0, seed)).x));
        (numbers.sum::<f64>() / f64::from(frames)) as f32
    };
    let pixel = |i: u32| {
        [
            (i % width) as f32 / width as f32,
            (i / width) as f32 / height as f32,
            mean(i),
        ]
    };
    (0..width * height).map(pixel).collect()
}

#[test]
fn a_frame_method_of_the_hosts_own_is_a_technique_like_others() {
    let gpu = gpu();
    let scene = clerestory::scene::load("builtin:cornell-box").unwrap();
    let renderer = Renderer::new(&gpu, &scene).unwrap();
    let (size, seed) = ([6, 5], 9);
    let options = RenderOptions {
        size,
        spp: 40,
        seed,
        ..RenderOptions::default()
    };
    let mut rendering = renderer.start_technique(&PLACES, &options).unwrap();
    let mut steps = 0;
    while rendering.step().unwrap().is_some() {
        steps += 1;
    }
    let found = rendering.picture().unwrap();
    let expected = places(size, seed, 40);
    let pixels = found.layer("radiance").unwrap().values().as_chunks::<3>().0;
    for (pixel, expected) in pixels.iter().zip(&expected) {
        // Means of 40 numbers are rounded once by the film, those of equal ones not at all.
        assert_eq!(pixel[..2], expected[..2]);
        assert!((pixel[2] - expected[2]).abs() <= f32::EPSILON, "{pixel:?} {expected:?}");
    }
    // One frame to compile, then 32 at most.
    assert_eq!(steps, 3);
    // Anew through another camera, and shown.
    rendering.set_camera(&scene.cameras[0].clone()).unwrap();
    // None is as good as one.
    rendering.set_spp(0);
    while rendering.step().unwrap().is_some() {}
    let screen = gpu
        .buffer(&BufferDesc::storage("screen", 4 * 30, Category::Film))
        .unwrap();
    for _ in 0..2 {
        rendering.display(&screen, 0.0, PixelFormat::Rgba8).unwrap();
    }
    let shown = gpu.read::<[u8; 4]>(screen.view(), 30).unwrap();
    assert!(
        shown.windows(2).take(5).all(|pair| pair[0][0] < pair[1][0]),
        "{shown:?}"
    );
    // A camera that cannot be used leaves name, passes and picture as they are.
    let blind = Camera {
        name: "blind".into(),
        lens_radius: f32::NAN,
        ..scene.cameras[0].clone()
    };
    let refused = rendering.set_camera(&blind).unwrap_err();
    assert!(matches!(refused, Error::Setting { .. }), "{refused}");
    let rendered = rendering.finish().unwrap();
    let report = &rendered.report;
    assert_eq!((report.technique.as_str(), report.samples), ("places", [1, 1]));
    assert_eq!((&report.camera, report.spp), (&scene.cameras[0].name, 1));
    assert!(!report.stopped_early);
    let expected = [("begun", 2), ("drawn", 41), ("frames", 41), ("samples", 41 * 30)];
    assert_eq!(
        report.counters,
        expected.map(|(name, count)| (name.to_owned(), count)).into()
    );
    let names: Vec<&str> = report.passes.iter().map(|pass| pass.name.as_str()).collect();
    assert_eq!(names, ["film: add frame", "places: draw"]);
    assert!(
        report
            .pipelines
            .iter()
            .any(|pipeline| pipeline.shader == add_frame::INFO.name)
    );
    assert_no_messages(&gpu);
}

/// 32 frames of a step would take more passes than a recorder has.
#[test]
fn frames_of_many_passes_take_more_steps() {
    const MANY: Card = Card {
        create: |gpu, _, view, _| places_with(gpu, view, 39),
        ..PLACES
    };
    let gpu = gpu();
    let scene = clerestory::scene::load("builtin:cornell-box").unwrap();
    let renderer = Renderer::new(&gpu, &scene).unwrap();
    let picture = |card: &Card| {
        let options = RenderOptions {
            size: [3, 2],
            spp: 70,
            ..RenderOptions::default()
        };
        let mut rendering = renderer.start_technique(card, &options).unwrap();
        while rendering.step().unwrap().is_some() {}
        rendering.finish().unwrap()
    };
    let (many, few) = (picture(&MANY), picture(&PLACES));
    assert_eq!((many.report.samples, many.report.counters["frames"]), ([70, 70], 70));
    let values = |rendered: &Rendered| rendered.picture.layer("radiance").unwrap().values().to_vec();
    assert_eq!(values(&many), values(&few));
    let idle = many.report.passes.iter().find(|pass| pass.name == "places: nothing");
    assert_eq!(idle.map(|pass| pass.count), Some(39 * 70));
    assert_no_messages(&gpu);
}

/// The table of hard cases takes cards of a host's own, progressive ones and frame methods alike.
#[test]
fn cards_of_the_hosts_own_are_judged_by_the_hard_cases() {
    let gpu = gpu();
    let case = clerestory_hard_cases::by_name("picture-sizes").unwrap();
    let subject = &Subject::of(&PLACES)[0];
    assert_eq!(subject.name(), "places");
    let outcome = judge(&gpu, case, subject).unwrap();
    assert_eq!(outcome.verdict, Verdict::Pass, "{outcome:?}");
    // Its pictures are whole and finite, but hold another light than is asked for: said, not hidden.
    let case = clerestory_hard_cases::by_name("empty-scene").unwrap();
    let outcome = judge(&gpu, case, subject).unwrap();
    assert_eq!(outcome.verdict, Verdict::Degrades, "{outcome:?}");
    assert!(outcome.reason.unwrap().contains("looks at nothing"));
    // One that says that it holds all light is held to it.
    let case = clerestory_hard_cases::by_name("one-triangle").unwrap();
    let outcome = judge(&gpu, case, &Subject::of(&EVEN)[0]).unwrap();
    assert_eq!(outcome.verdict, Verdict::Refused, "{outcome:?}");
    static WITHOUT_REFUSALS: Card = Card {
        refusals: |_| Vec::new(),
        ..EVEN
    };
    let case = clerestory_hard_cases::by_name("black-and-white").unwrap();
    let outcome = judge(&gpu, case, &Subject::of(&WITHOUT_REFUSALS)[0]).unwrap();
    assert_eq!(outcome.verdict, Verdict::Fails, "{outcome:?}");
    assert_no_messages(&gpu);
}

#[test]
fn a_technique_is_refused_with_the_reason_before_it_is_made() {
    const NEVER: Card = Card {
        create: |_, _, _, _| panic!("made in spite of the refusal"),
        ..EVEN
    };
    let host = Host::new();
    let gpu = host.lend(EnabledFeatures::REQUIRED).unwrap();
    let sky = Renderer::new(&gpu, &clerestory::scene::load("builtin:box-city?n=2").unwrap()).unwrap();
    let closed = Renderer::new(&gpu, &clerestory::scene::load("builtin:cornell-box").unwrap()).unwrap();
    let refusal = |renderer: &Renderer, info: &Card| {
        let options = RenderOptions::default();
        renderer.start_technique(info, &options).err().expect("a refusal")
    };
    // The host did not enable it.
    let needy = Card {
        needs: &["geometryShader"],
        kernels: &[],
        ..NEVER
    };
    let error = refusal(&sky, &needy);
    assert!(matches!(error, Error::MissingFeature { .. }), "{error}");
    let text = error.to_string();
    for word in [
        "technique even",
        "geometryShader",
        "enable it",
        "run here: path",
        &gpu.caps().device,
    ] {
        assert!(text.contains(word), "{word:?} is not in: {text}");
    }
    let misspelt = Card {
        needs: &["geometryShaders"],
        kernels: &[],
        ..NEVER
    };
    let text = refusal(&sky, &misspelt).to_string();
    assert!(
        text.starts_with("setting needs: geometryShaders") && text.contains("shaderInt64"),
        "{text}"
    );
    let text = refusal(&closed, &NEVER).to_string();
    assert!(text.contains("even") && text.contains("there is no sky"), "{text}");
    drop((sky, closed, gpu));
}

#[test]
fn settings_of_a_hosts_own_come_as_struct_or_json_and_are_checked_by_their_declaration() {
    let host = Host::new();
    let gpu = host.lend(EnabledFeatures::REQUIRED).unwrap();
    let renderer = Renderer::new(&gpu, &clerestory::scene::load("builtin:box-city?n=2").unwrap()).unwrap();
    let start = |settings: Settings| {
        let options = RenderOptions {
            size: [2, 2],
            settings,
            ..RenderOptions::default()
        };
        renderer.start_technique(&EVEN, &options)
    };
    let brightness = |settings| {
        let mut rendering = start(settings).unwrap();
        while rendering.step().unwrap().is_some() {}
        rendering.picture().unwrap().layer("radiance").unwrap().values()[0]
    };
    let typed = |radiance| EvenSettings { radiance };
    assert_eq!(brightness(Settings::default()), 1.0);
    assert_eq!(brightness(typed(0.5).into()), 0.5);
    assert_eq!(brightness(serde_json::json!({"radiance": 0.5}).into()), 0.5);
    for (settings, words) in [
        (
            typed(-1.0).into(),
            "setting radiance: -1 is out of range; it may be 0 or more (W·m⁻²·sr⁻¹)",
        ),
        (
            serde_json::json!({"radiance": -1.5}).into(),
            "setting radiance: -1.5 is out of range",
        ),
        (
            serde_json::json!({"radiance": "x"}).into(),
            "setting radiance: \"x\" does not fit",
        ),
        (serde_json::json!({"colour": 1}).into(), "there is: radiance"),
        (
            Settings::of(PathTracerSettings::default()),
            "is for no setting of that name; there is: radiance",
        ),
    ] {
        let text = start(settings).err().expect("a refusal").to_string();
        assert!(text.contains(words), "{words}: {text}");
    }
    let info = &EVEN.settings.infos()[0];
    assert_eq!(
        (info.name, info.meaning.as_str()),
        ("radiance", "Radiance of every sample")
    );
    drop((renderer, gpu));
}
