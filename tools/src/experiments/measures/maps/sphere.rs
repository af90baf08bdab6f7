//! Pictures of a sphere from afar, side by side.

use clerestory::film::png::Rgb8;
use glam::{DVec2, DVec3};

const GAP: u32 = 4;

/// A sphere as seen from a direction, without perspective.
pub struct Sphere {
    towards: DVec3,
    right: DVec3,
    up: DVec3,
    /// Pixels across.
    pub side: u32,
    /// Pixels down.
    pub rows: u32,
}

impl Sphere {
    /// Seen from `eye`, with +z up, on so many pixels across and down.
    pub fn new(eye: DVec3, side: u32) -> Self {
        Self::of_pixels(eye, [side, side])
    }

    /// The same, of pixels that need not be square.
    pub fn of_pixels(eye: DVec3, [side, rows]: [u32; 2]) -> Self {
        let towards = eye.normalize();
        let right = DVec3::Z.cross(towards).normalize();
        Self {
            towards,
            right,
            up: towards.cross(right),
            side,
            rows,
        }
    }

    /// A pixel's place in \[-1, 1\]², up and to the right.
    pub fn place(&self, x: u32, y: u32) -> DVec2 {
        let p = (DVec2::new(f64::from(x), f64::from(y)) + 0.5) / DVec2::new(f64::from(self.side), f64::from(self.rows));
        DVec2::new(2.0 * p.x - 1.0, 1.0 - 2.0 * p.y)
    }

    /// The normal at a place; `None` beside the sphere.
    pub fn normal(&self, p: DVec2) -> Option<DVec3> {
        let squared = p.length_squared();
        (squared < 1.0).then(|| p.x * self.right + p.y * self.up + (1.0 - squared).sqrt() * self.towards)
    }

    /// What the normal changes by from a pixel to the one across, and to the one below: derivatives.
    pub fn normal_derivatives(&self, p: DVec2) -> Option<[DVec3; 2]> {
        let squared = p.length_squared();
        let [wide, high] = [self.side, self.rows].map(|pixels| 2.0 / f64::from(pixels));
        (squared < 1.0).then(|| {
            let by = |axis: DVec3, coordinate: f64| axis - coordinate / (1.0 - squared).sqrt() * self.towards;
            [wide * by(self.right, p.x), -high * by(self.up, p.y)]
        })
    }

    /// Where a mirror looks at a place.
    pub fn mirrored(&self, p: DVec2) -> Option<DVec3> {
        let n = self.normal(p)?;
        Some(2.0 * n.dot(self.towards) * n - self.towards)
    }
}

/// Pictures in rows, each of the same size.
pub fn sheet(rows: &[Vec<Rgb8>]) -> Rgb8 {
    let Some(first) = rows.first().and_then(|row| row.first()) else {
        return Rgb8 {
            width: 0,
            height: 0,
            bytes: Vec::new(),
        };
    };
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0) as u32;
    let (across, down) = (first.width + GAP, first.height + GAP);
    let (width, height) = (columns * across - GAP, rows.len() as u32 * down - GAP);
    let mut bytes = vec![255; (width * height * 3) as usize];
    for (row, pictures) in rows.iter().enumerate() {
        for (column, picture) in pictures.iter().enumerate() {
            for (y, line) in picture.bytes.chunks_exact(3 * picture.width as usize).enumerate() {
                let (left, top) = (column * across as usize, row * down as usize + y);
                let at = 3 * (top * width as usize + left);
                bytes[at..at + line.len()].copy_from_slice(line);
            }
        }
    }
    Rgb8 { width, height, bytes }
}
