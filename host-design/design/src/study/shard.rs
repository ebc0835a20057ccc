//! One of the parts that a study is split into.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Shard `number` (from 1) of `of`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    number: u64,
    of: u64,
}

impl Shard {
    /// Number of this shard, from 1.
    pub fn number(self) -> u64 {
        self.number
    }

    /// Number of shards in the study.
    pub fn shards(self) -> u64 {
        self.of
    }

    /// Numbers of its runs out of `runs`: every `of`-th, so that all shards take about the same time.
    pub fn numbers(self, runs: u64) -> impl Iterator<Item = u64> {
        (self.number.saturating_sub(1)..runs).step_by(self.of.max(1) as usize)
    }

    /// Whether the number is from 1 to the number of shards.
    pub(super) fn is_valid(self) -> bool {
        (1..=self.of).contains(&self.number)
    }
}

impl FromStr for Shard {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let accepts = "give K/N, the K-th of N shards, such as 2/3";
        let (number, of) = text.split_once('/').ok_or(accepts)?;
        let shard =
            Self { number: number.parse().map_err(|_| accepts)?, of: of.parse().map_err(|_| accepts)? };
        if shard.is_valid() { Ok(shard) } else { Err(accepts) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_run_is_in_one_shard() {
        let shards = ["1/3", "2/3", "3/3"].map(|text| text.parse::<Shard>().unwrap());
        let mut all: Vec<u64> = shards.into_iter().flat_map(|shard| shard.numbers(8)).collect();
        assert_eq!(all, [0, 3, 6, 1, 4, 7, 2, 5]);
        all.sort_unstable();
        assert_eq!(all, (0..8).collect::<Vec<_>>());
        for bad in ["", "1", "0/3", "4/3", "1/0", "-1/3", "a/b", "1/3/5"] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
    }
}
