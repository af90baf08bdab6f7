//! Samples under way in a wave that is kept full: which begin, which have ended, and which of them have reached the film, in the order of the samples.
//!
//! Samples are numbered in the order in which waves ([`Cursor`](super::wave::Cursor)) have them. Paths end in any order; what they have gathered waits among as many
//! results as are kept, over and over, until all samples before it have ended. So pixels get their samples in order, and memory is bounded: samples begin as long as
//! there are results for them.

use std::collections::VecDeque;

use super::wave::Wave;

/// Consecutive samples of a wave, with results one behind the other.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub wave: Wave,
    /// In the wave.
    pub first: u32,
    pub count: u32,
    /// Of the first one.
    pub result: u32,
}

/// How far samples are.
#[derive(Debug)]
pub(super) struct SamplesInOrder {
    /// How many are kept.
    results: u64,
    /// Waves whose samples are not all on the film, each with the number of its first one.
    waves: VecDeque<(Wave, u64)>,
    /// Of samples that are on the film.
    resolved: u64,
    /// Before which all have ended.
    ended: u64,
    begun: u64,
    /// Behind all waves.
    end: u64,
}

impl SamplesInOrder {
    pub fn new(results: u32) -> Self {
        Self {
            results: results.into(),
            waves: VecDeque::new(),
            resolved: 0,
            ended: 0,
            begun: 0,
            end: 0,
        }
    }

    /// Samples before which all have ended.
    pub fn ended(&self) -> u64 {
        self.ended
    }

    /// Whether some have ended that are not on the film.
    pub fn are_pending(&self) -> bool {
        self.resolved < self.ended
    }

    /// All that have not ended begin anew: their paths are lost.
    pub fn lose(&mut self) {
        self.begun = self.ended;
    }

    /// Begins samples in at most `free` slots, those that have ended being on the film by then. Waves follow from `next_wave`, as long as there is one.
    pub fn begin(&mut self, free: u32, mut next_wave: impl FnMut() -> Option<Wave>) -> Vec<Piece> {
        let until = self.begun + u64::from(free).min(self.results - (self.begun - self.ended));
        while self.end < until {
            let Some(wave) = next_wave() else { break };
            self.waves.push_back((wave, self.end));
            self.end += u64::from(wave.paths());
        }
        let pieces = self.pieces(self.begun, until.min(self.end));
        self.begun = until.min(self.end);
        pieces
    }

    /// Notes what a submission has left: `walks` paths that are alive, and the result of the oldest of them. How many waves have ended by it.
    pub fn note(&mut self, walks: u32, oldest: u32) -> u64 {
        let before = self.ended;
        self.ended = if walks == 0 {
            self.begun
        } else {
            before + (u64::from(oldest) + self.results - before % self.results) % self.results
        };
        let ends = self.waves.iter().map(|(wave, first)| first + u64::from(wave.paths()));
        ends.filter(|end| (before + 1..=self.ended).contains(end)).count() as u64
    }

    /// What is to reach the film.
    pub fn pending(&self) -> Vec<Piece> {
        self.pieces(self.resolved, self.ended)
    }

    /// It has.
    pub fn resolve(&mut self) {
        self.resolved = self.ended;
        while let Some((wave, first)) = self.waves.front()
            && first + u64::from(wave.paths()) <= self.resolved
        {
            self.waves.pop_front();
        }
    }

    /// The samples from `first` on that come before `end`.
    fn pieces(&self, first: u64, end: u64) -> Vec<Piece> {
        let mut pieces = Vec::new();
        for (wave, begin) in &self.waves {
            let wave_end = end.min(begin + u64::from(wave.paths()));
            let mut sample = first.max(*begin);
            while sample < wave_end {
                let result = sample % self.results;
                let count = (wave_end - sample).min(self.results - result);
                pieces.push(Piece {
                    wave: *wave,
                    first: (sample - begin) as u32,
                    count: count as u32,
                    result: result as u32,
                });
                sample += count;
            }
        }
        pieces
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(first_pixel: u32, pixels: u32, samples: u32) -> Wave {
        Wave {
            band: 0,
            first_pixel,
            pixels,
            first_sample: 0,
            samples,
            places: None,
        }
    }

    /// Pixel of the wave's first one, then first sample, count and result of pieces.
    fn told(pieces: &[Piece]) -> Vec<[u32; 4]> {
        let tell = |piece: &Piece| [piece.wave.first_pixel, piece.first, piece.count, piece.result];
        pieces.iter().map(tell).collect()
    }

    #[test]
    fn samples_begin_within_the_results_and_end_in_order() {
        let mut samples = SamplesInOrder::new(16);
        let mut waves = [wave(0, 5, 2), wave(5, 10, 2)].into_iter();
        assert_eq!(told(&samples.begin(8, || waves.next())), [[0, 0, 8, 0]]);
        // The first four have ended, and those behind the fifth, which waits.
        assert_eq!(samples.note(1, 4), 0);
        assert!(samples.are_pending());
        assert_eq!(told(&samples.pending()), [[0, 0, 4, 0]]);
        // Over the end of a wave and of the results; no more than results are free.
        let begun = samples.begin(100, || waves.next());
        samples.resolve();
        assert_eq!(told(&begun), [[0, 8, 2, 8], [5, 0, 6, 10], [5, 6, 4, 0]]);
        assert!(samples.begin(100, || waves.next()).is_empty());
        // A sample of the second round is the oldest one.
        assert_eq!(samples.note(3, 2), 1);
        assert_eq!(samples.ended(), 18);
        assert_eq!(told(&samples.pending()), [[0, 4, 6, 4], [5, 0, 6, 10], [5, 6, 2, 0]]);
        samples.resolve();
        assert!(!samples.are_pending());
        // What is lost begins again, and the rest behind it.
        samples.lose();
        assert_eq!(told(&samples.begin(100, || waves.next())), [[5, 8, 12, 2]]);
        assert_eq!(samples.note(0, 9), 1);
        assert_eq!(told(&samples.pending()), [[5, 8, 12, 2]]);
        assert_eq!(samples.ended(), 30);
        samples.resolve();
        assert!(samples.begin(100, || waves.next()).is_empty());
    }

    #[test]
    fn all_results_may_be_taken() {
        let mut samples = SamplesInOrder::new(4);
        let mut waves = std::iter::repeat_with(|| wave(0, 2, 1));
        assert_eq!(told(&samples.begin(9, || waves.next())), [[0, 0, 2, 0], [0, 0, 2, 2]]);
        // The first one of all is the oldest: none has ended.
        assert_eq!((samples.note(1, 0), samples.ended()), (0, 0));
        assert!(samples.begin(9, || waves.next()).is_empty());
        assert_eq!((samples.note(0, 0), samples.ended()), (2, 4));
    }
}
