//! A study split over several processes or machines.

use std::path::PathBuf;

use clap::Args;
use serde_json::Value;
use upright_design::rig::Rig;
use upright_design::study::{Shard, Study, about};

use upright_command::Failure;

#[derive(Args)]
pub(crate) struct Split {
    /// Do only every N-th run, starting with the K-th, and print the outcomes as lines of JSON for --merge
    #[arg(long, value_name = "K/N", conflicts_with = "merge")]
    shard: Option<Shard>,
    /// Do no run, but read the outcomes from the files of all shards; the other options must be the same
    #[arg(long, value_name = "FILE", num_args = 1..)]
    merge: Vec<PathBuf>,
}

impl Split {
    /// Whether --shard or --merge is given.
    pub(crate) fn is_used(&self) -> bool {
        self.shard.is_some() || !self.merge.is_empty()
    }

    /// Does `work` with the study that the options ask for, then passes its result to `print`; a shard prints the
    /// outcomes of its runs instead. `options` are those on which the outcomes depend.
    pub(crate) fn study<T>(
        &self,
        command: &str,
        rig: &Rig,
        options: &Value,
        work: impl FnOnce(&Study) -> Result<T, Failure>,
        print: impl FnOnce(T) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let about = about(command, rig, options);
        let study = match self.shard {
            Some(shard) => Study::shard(shard),
            None if self.merge.is_empty() => Study::whole(),
            None => Study::merged(&self.merge, &about)?,
        };
        let made = work(&study)?;
        if study.is_shard() { Ok(study.write(&about, std::io::stdout().lock())?) } else { print(made) }
    }
}
