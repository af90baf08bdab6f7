//! What a place sees in all directions, drawn piece by piece: surfaces of eight octants, shadow maps, and the preview's shading. Each piece is bounded, whatever the scene.

use std::collections::VecDeque;
use std::ops::Range;

use super::capture::{CaptureBy, CapturePlan};
use crate::Result;
use crate::gpu::{Area, Buffer, Gpu, PipelineInfo, Timings};
use crate::maps::octahedron::OctahedronLayout;
use crate::raster::{Coverage, DrawPart, GBuffer, GBufferDesc, Layering, OctantCut, Output, View};
use crate::techniques::Part;
use crate::techniques::preview::{
    Eye, LightMap, LightRoom, PreviewLights, PreviewPart, PreviewShadows, SHADED_OUTPUTS, Seen, Shade, Target,
};
use crate::transport::GpuScene;

/// Pictures of what a place sees, and what is left to do for them.
pub(super) struct MapDrawing {
    gbuffer: GBuffer,
    shading: Option<Shading>,
    coverage: Coverage,
    pieces: VecDeque<Piece>,
    is_drawn: bool,
}

/// What shades a map.
struct Shading {
    lights: PreviewLights,
    shade: Shade,
}

/// A piece of the work.
enum Piece {
    /// Finds in which parts surfaces are drawn.
    MeasureSurfaces,
    Surfaces(DrawPart),
    Lights,
    /// Finds in which parts the shadow map of a light is drawn.
    MeasureShadow(LightMap),
    Shadow(LightMap, DrawPart),
    /// Shades these texels.
    Shade(Range<u32>),
}

/// The shadow maps of a map.
pub(super) fn shadows_of_side(side: u32) -> PreviewShadows {
    PreviewShadows {
        side,
        ..PreviewShadows::default()
    }
}

impl MapDrawing {
    /// Allocates pictures by a plan, with shading where the map is captured by rasterization.
    pub fn new(gpu: &Gpu, scene: &GpuScene, plan: &CapturePlan) -> Result<Self> {
        let surfaces = scene.surfaces();
        let is_shaded = plan.by == CaptureBy::Raster;
        let mut outputs = Vec::new();
        if is_shaded {
            outputs.extend(SHADED_OUTPUTS);
        }
        // Paths begin by distances, whoever else wants them.
        if plan.with_distances || !is_shaded {
            outputs.push(Output::Distance);
        }
        if plan.with_normals {
            outputs.push(Output::Normals);
        }
        if plan.layers > 1 {
            outputs.push(Output::Triangle);
        }
        let gbuffer = GBuffer::new(
            gpu,
            &surfaces,
            &GBufferDesc {
                size: [plan.side; 2],
                layering: Layering::Octants(OctantCut::default()),
                outputs: &outputs,
            },
        )?;
        let shading = || -> Result<_> {
            let room = LightRoom::of(&scene.lights_without_area());
            let shadows = (!room.is_without_maps()).then(|| shadows_of_side(plan.shadow_side));
            let lights = PreviewLights::new(gpu, &surfaces, room, shadows)?;
            let shade = Shade::new(gpu, scene, &lights, true, None)?;
            Ok(Shading { lights, shade })
        };
        let shading = is_shaded.then(shading).transpose()?;
        let mut pieces = VecDeque::from([Piece::MeasureSurfaces]);
        if let Some(shading) = &shading {
            let texels = plan.side * plan.side;
            let of = shading.lights.shading_parts(gpu, texels.into());
            let part = |number| Piece::Shade(Part { number, of }.range(texels));
            pieces.push_back(Piece::Lights);
            pieces.extend((0..of).map(part));
        }
        Ok(Self {
            gbuffer,
            shading,
            coverage: Coverage::new(gpu)?,
            pieces,
            is_drawn: false,
        })
    }

    /// What draws it, its shadow maps and its shading.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = self.gbuffer.pipelines();
        if let Some(Shading { lights, shade }) = &self.shading {
            all.extend(lights.pipelines());
            all.extend(shade.pipelines());
        }
        all
    }

    /// What was drawn.
    pub fn gbuffer(&self) -> &GBuffer {
        &self.gbuffer
    }

    /// Whether all surfaces are drawn: what is read of them is read before they are shaded.
    pub fn is_drawn(&self) -> bool {
        self.is_drawn
    }

    /// Whether nothing is left to do.
    pub fn is_done(&self) -> bool {
        self.pieces.is_empty()
    }

    /// A piece of the work; radiance goes row by row to a buffer.
    pub fn advance(
        &mut self,
        gpu: &Gpu,
        scene: &GpuScene,
        plan: &CapturePlan,
        radiance: &Buffer,
    ) -> Result<Vec<Timings>> {
        let Some(piece) = self.pieces.pop_front() else {
            return Ok(Vec::new());
        };
        let surfaces = scene.surfaces();
        let area = [plan.side; 2];
        let octants = || {
            let near = View::near_plane(plan.place, &surfaces);
            View::of_octants(plan.place, OctahedronLayout::Quadratic, near, Area::whole(area))
        };
        let mut recorder = gpu.recorder("capture")?;
        match (piece, &mut self.shading) {
            (Piece::MeasureSurfaces, _) => {
                let parts = self.coverage.parts(&surfaces, &octants()?, area)?;
                let parts = parts_without(&parts, surfaces.triangles, &plan.left_out);
                self.put_first(parts.into_iter().map(Piece::Surfaces));
                return Ok(Vec::new());
            }
            (Piece::Surfaces(part), _) => {
                self.is_drawn = part.ends;
                self.gbuffer.record_part(&mut recorder, &surfaces, &octants()?, &part)?;
            }
            (Piece::Lights, Some(Shading { lights, .. })) => {
                let maps = lights.record_lights(&mut recorder, &surfaces, &scene.lights_without_area())?;
                self.put_first(maps.into_iter().map(Piece::MeasureShadow));
            }
            (Piece::MeasureShadow(map), Some(Shading { lights, .. })) => {
                let parts = lights.parts_of_map(&self.coverage, &surfaces, &map)?;
                self.put_first(parts.into_iter().map(|part| Piece::Shadow(map, part)));
                return Ok(Vec::new());
            }
            (Piece::Shadow(map, part), Some(Shading { lights, .. })) => {
                lights.record_map(&mut recorder, &surfaces, &map, &part)?;
            }
            (Piece::Shade(texels), Some(Shading { lights, shade })) => {
                recorder.pass("capture: shade", |pass| {
                    let seen = Seen {
                        scene,
                        gbuffer: &self.gbuffer,
                        lights: &*lights,
                        eye: Eye::AllDirections(plan.place),
                        target: Target {
                            buffer: radiance,
                            first: 0,
                            stride: plan.side,
                        },
                    };
                    let part = PreviewPart {
                        triangles: 0..surfaces.triangles,
                        background: true,
                        probe: None,
                    };
                    shade.record_pixels(pass, &seen, &[part], texels)
                })?;
            }
            (_, None) => return Ok(Vec::new()),
        }
        Ok(vec![recorder.submit()?.wait()?])
    }

    /// Before all that is left to do.
    fn put_first(&mut self, pieces: impl DoubleEndedIterator<Item = Piece>) {
        for piece in pieces.rev() {
            self.pieces.push_front(piece);
        }
    }
}

/// Numbers of triangles, up to a count, but those that are left out; an empty range where none is left.
fn ranges_without(count: u32, left_out: &[Range<u32>]) -> Vec<Range<u32>> {
    let mut kept = Vec::new();
    let mut start = 0;
    for range in left_out {
        if start < range.start {
            kept.push(start..range.start);
        }
        start = start.max(range.end);
    }
    if start < count || kept.is_empty() {
        kept.push(start.min(count)..count);
    }
    kept
}

/// Parts of all triangles without those that are left out: one at least, since an empty picture is drawn, too.
fn parts_without(parts: &[DrawPart], count: u32, left_out: &[Range<u32>]) -> Vec<DrawPart> {
    let kept = ranges_without(count, left_out);
    let common = |a: &Range<u32>, b: &Range<u32>| a.start.max(b.start)..a.end.min(b.end);
    let pairs = parts
        .iter()
        .flat_map(|part| kept.iter().map(move |kept| common(&part.triangles, kept)));
    let mut drawn: Vec<Range<u32>> = pairs.filter(|range| !range.is_empty()).collect();
    if drawn.is_empty() {
        drawn.push(count..count);
    }
    let last = drawn.len() - 1;
    let part = |(number, triangles)| DrawPart {
        triangles,
        begins: number == 0,
        ends: number == last,
    };
    drawn.into_iter().enumerate().map(part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[expect(clippy::single_range_in_vec_init, reason = "ranges of triangles, not their numbers")]
    fn parts_are_all_but_what_is_left_out() {
        let drawn = |count: u32, left_out: &[Range<u32>]| -> Vec<Range<u32>> {
            let parts = ranges_without(count, left_out);
            assert!(parts.iter().all(|range| range.end <= count));
            parts
        };
        assert_eq!(drawn(10, &[]), [0..10]);
        assert_eq!(drawn(10, &[2..4, 4..5, 7..10]), [0..2, 5..7]);
        assert_eq!(drawn(10, &[0..3]), [3..10]);
        assert_eq!(drawn(4, &[0..4]), [4..4]);
        assert_eq!(drawn(0, &[]), [0..0]);

        let part = |triangles: Range<u32>| DrawPart {
            triangles,
            begins: false,
            ends: false,
        };
        let found = parts_without(&[part(0..4), part(4..8), part(8..10)], 10, &[2..5, 8..10]);
        let found: Vec<_> = found
            .into_iter()
            .map(|part| (part.triangles, part.begins, part.ends))
            .collect();
        assert_eq!(found, [(0..2, true, false), (5..8, false, true)]);
        let none = parts_without(&[part(0..4)], 4, &[0..4]);
        assert!(none.len() == 1 && none[0].triangles.is_empty() && none[0].begins && none[0].ends);
    }
}
