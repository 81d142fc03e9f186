//! Sampling one replicate of one estimator: continued from what is on disk, kept there.

use super::{PlannedScene, Runner, sample};
use crate::error::{Error, Result};
use crate::estimator::{Cell, Estimate, Estimator};
use crate::moments::cell::{CellFolder, Checkpoint, Saving};
use crate::sampling::{Key, Role, Strategy};

/// One replicate of one estimator, being sampled: the estimate so far and where it is kept.
pub(super) struct Track<'a> {
    pub(super) estimator: &'a dyn Estimator,
    /// The estimator's identity, role, seed and replicate as text.
    identity: String,
    pub(super) key: Key,
    current: Option<Estimate>,
    /// Samples per value of the state on disk, once it was read or written; 0 before.
    stored: u64,
    saving: Saving,
    /// The state is kept at this checkpoint and all later ones.
    last: u64,
}

impl Track<'_> {
    /// The same for a run that may end here, so that its state is kept.
    pub(super) fn ending_at(self, n: u64) -> Self {
        Self { last: n, ..self }
    }
}

impl Runner<'_> {
    /// The states of all tracks that are further on than what is on disk.
    pub(super) fn keep_states(&self, tracks: &[Track<'_>]) -> Result<()> {
        for track in tracks {
            if let Some(estimate) = track.current.as_ref().filter(|e| e.abscissa > track.stored) {
                let shape = track.estimator.shape();
                self.folder(track, estimate.abscissa).save_state(estimate, shape.pixels(), shape.channels)?;
            }
        }
        Ok(())
    }

    /// Runs one sample of every strategy that has anything left to compute, and throws it away.
    pub(super) fn warm_up(&self, scene: &PlannedScene<'_>) -> Result<()> {
        for c in &scene.contenders {
            let track = self.track(&*c.estimator, &c.strategy, Role::Run, 0);
            let last = *self.plan.checkpoints.last().expect("a plan has checkpoints");
            if self.fresh || !self.folder(&track, last).has(last) {
                c.estimator.estimate(&Cell { key: track.key, length: 1 }, 1, &mut None)?;
            }
        }
        Ok(())
    }

    pub(super) fn track<'e>(
        &self,
        estimator: &'e dyn Estimator,
        strategy: &Strategy,
        role: Role,
        replicate: u32,
    ) -> Track<'e> {
        let seed = self.plan.seed;
        let identity = format!(
            "rootn {} · {} · {} · seed {seed} · {} · replicate {replicate}",
            env!("CARGO_PKG_VERSION"),
            estimator.identity(),
            strategy.identity(),
            role.name()
        );
        Track {
            estimator,
            identity,
            key: Key::new(seed, role, &strategy.identity(), replicate),
            current: None,
            stored: 0,
            saving: Saving::default(),
            last: match role {
                Role::Run => self.plan.checkpoints.last().copied().unwrap_or(0),
                Role::Reference | Role::Calibration => 0,
            },
        }
    }

    /// Where the estimate at `n` of a track is kept. Sequences that are not progressive have a cell per N.
    pub(super) fn folder(&self, track: &Track<'_>, n: u64) -> CellFolder {
        let identity = match track.estimator.progressive() {
            true => track.identity.clone(),
            false => format!("{} · length {n}", track.identity),
        };
        CellFolder::new(&self.cells, identity)
    }

    /// The checkpoint `n` of a track: from disk, or sampled now and kept.
    pub(super) fn advance(&mut self, track: &mut Track<'_>, n: u64) -> Result<Checkpoint> {
        let folder = self.folder(track, n);
        let shape = track.estimator.shape();
        let before = if track.estimator.progressive() { self.previous(n) } else { 0 };
        let samples = (n - before).saturating_mul(shape.pixels() as u64);
        if self.fresh && track.current.is_none() {
            folder.remove()?;
        }
        match folder.load_checkpoint(n, shape.values()) {
            Ok(Some(found)) => {
                self.reuse.reused += 1;
                self.bar.set_length(self.bar.length().unwrap_or(0).saturating_sub(samples));
                return Ok(found);
            }
            Err(e @ Error::Damaged { .. }) => self.warn_damaged(&e),
            Err(e) => return Err(e),
            Ok(None) => {}
        }
        track.current = self.resume(track, &folder, n)?;
        // What a killed run left no state of is sampled again.
        let again = before.saturating_sub(track.current.as_ref().map_or(0, |e| e.abscissa));
        self.bar.inc_length(again.saturating_mul(shape.pixels() as u64));
        let cell = Cell { key: track.key, length: n };
        let sampled = sample(track.estimator, &cell, n, &mut track.current, &self.bar);
        // A state that is further on stays. That one cannot be kept is told before why it has to be.
        let keep = |e: &Estimate, stored: u64| match e.abscissa > stored {
            true => folder.save_state(e, shape.pixels(), shape.channels),
            false => Ok(()),
        };
        if let (Err(_), Some(kept)) = (&sampled, track.current.take()) {
            keep(&kept, track.stored)?;
        }
        let (estimate, interrupted) = sampled?;
        if interrupted && estimate.abscissa < n {
            keep(&estimate, track.stored)?;
            return Err(Error::Interrupted);
        }
        let checkpoint = Checkpoint::of(&estimate);
        folder.save_checkpoint(n, &checkpoint)?;
        self.reuse.computed += 1;
        if track.estimator.progressive() {
            // A state that is further on stays: longer runs continue from it.
            if n > track.stored && (n >= track.last || track.saving.is_worth_it(estimate.seconds)) {
                track.saving.write(&folder, &estimate, shape.pixels(), shape.channels)?;
                track.stored = n;
            }
            track.current = Some(estimate);
        } else if track.stored > 0 {
            // An interrupted run left it; nothing continues from here.
            folder.remove_state()?;
            track.stored = 0;
        }
        if interrupted {
            return Err(Error::Interrupted);
        }
        Ok(checkpoint)
    }

    /// The checkpoint before `n`, or 0.
    fn previous(&self, n: u64) -> u64 {
        self.plan.checkpoints.iter().copied().take_while(|&c| c < n).last().unwrap_or(0)
    }

    /// The estimate to continue from: the track's own, or the state on disk, where it does not lie beyond `n`.
    fn resume(&mut self, track: &mut Track<'_>, folder: &CellFolder, n: u64) -> Result<Option<Estimate>> {
        let current = track.current.take();
        if current.as_ref().is_some_and(|e| e.abscissa >= track.stored || n < track.stored) {
            return Ok(current);
        }
        let shape = track.estimator.shape();
        match folder.load_state(shape.pixels(), shape.channels) {
            Ok(state) => {
                track.stored = state.as_ref().map_or(0, |e| e.abscissa);
                track.saving = Saving::from_disk(state.as_ref().map_or(0.0, |e| e.seconds));
                Ok(state.filter(|e| e.abscissa <= n).or(current))
            }
            Err(e @ Error::Damaged { .. }) => {
                self.warn_damaged(&e);
                (track.stored, track.saving) = (0, Saving::default());
                Ok(current)
            }
            Err(e) => Err(e),
        }
    }

    fn warn_damaged(&mut self, e: &Error) {
        self.warnings.push(format!("recomputed a stored result: {e}"));
    }
}
