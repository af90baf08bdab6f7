//! Checks in debug builds that every hazard between passes has its barrier.
//!
//! Synchronization validation misses barriers between two dispatches over one storage buffer, so the recorder keeps its own book: what each
//! dispatch and copy reads and writes (from reflection, so that no author can forget to say it) against the barriers recorded. Whole
//! buffers are tracked; two passes that use disjoint parts of one buffer still want a barrier.

use std::collections::BTreeMap;

use super::barrier::Access;
use super::buffer::Buffer;
use crate::{Error, Result};

/// What is pending for one buffer.
#[derive(Debug, Default)]
struct Pending {
    /// The last write.
    write: Option<Use>,
    /// The uses that the last write has been made visible to.
    visible_to: Access,
    /// Reads since the last write by commands before the one in `reads`, under the name of the last of these.
    earlier_reads: Option<Use>,
    /// Reads since the last write by the last command that did; a later write must wait for all.
    reads: Option<Use>,
}

#[derive(Debug)]
struct Use {
    pass: String,
    command: u64,
    access: Access,
}

/// The book of one command buffer.
#[derive(Debug, Default)]
pub(super) struct Tracker {
    buffers: BTreeMap<u64, Pending>,
    command: u64,
}

impl Tracker {
    /// Begins the next command; uses by one command never conflict with each other.
    pub fn next_command(&mut self) {
        self.command += 1;
    }

    /// Notes that the current command of `pass` uses the buffer, after checking it against what is pending.
    pub fn touch(&mut self, pass: &str, buffer: &Buffer, access: Access) -> Result<()> {
        let command = self.command;
        let pending = self.buffers.entry(buffer.inner.id).or_default();
        let writes = !access.writes().is_empty();
        let missing = |earlier: &Use| Error::MissingBarrier {
            pass: pass.into(),
            access: if writes { "writes" } else { "reads" },
            buffer: buffer.name().into(),
            earlier: earlier.pass.clone(),
        };
        if let Some(write) = pending
            .write
            .as_ref()
            .filter(|write| write.command != command && !pending.visible_to.contains(access))
        {
            return Err(missing(write));
        }
        let mut reads = pending.reads.iter().chain(&pending.earlier_reads);
        if let Some(read) = reads.find(|read| writes && read.command != command) {
            return Err(missing(read));
        }
        let used = |access| {
            Some(Use {
                pass: pass.into(),
                command,
                access,
            })
        };
        if writes {
            *pending = Pending {
                write: used(access),
                visible_to: Access::NONE,
                earlier_reads: None,
                reads: None,
            };
        } else {
            match &mut pending.reads {
                Some(read) if read.command == command => read.access = read.access | access,
                reads => {
                    if let Some(mut read) = reads.take() {
                        let earlier = pending.earlier_reads.as_ref().map_or(Access::NONE, |read| read.access);
                        read.access = read.access | earlier;
                        pending.earlier_reads = Some(read);
                    }
                    *reads = used(access);
                }
            }
        }
        Ok(())
    }

    /// Notes a barrier on one buffer.
    pub fn barrier(&mut self, buffer: &Buffer, from: Access, to: Access) {
        if let Some(pending) = self.buffers.get_mut(&buffer.inner.id) {
            pending.barrier(from, to);
        }
    }

    /// Notes a barrier on all buffers.
    pub fn barrier_all(&mut self, from: Access, to: Access) {
        self.buffers.values_mut().for_each(|pending| pending.barrier(from, to));
    }
}

impl Pending {
    fn barrier(&mut self, from: Access, to: Access) {
        if let Some(write) = &self.write {
            // A later barrier chains on an earlier one when it waits for a stage that the earlier one held back.
            let chained = self.visible_to.without_stages_of(from) != self.visible_to;
            if from.contains(write.access.writes()) || chained {
                self.visible_to = self.visible_to | to;
            }
        }
        for pending in [&mut self.earlier_reads, &mut self.reads] {
            pending.take_if(|reads| {
                reads.access = reads.access.without_stages_of(from);
                reads.access.is_empty()
            });
        }
    }
}
