//! Independent computations, spread over all processors.
//!
//! The threads are rayon's. Its own iterators are compiled again for each use; the functions here share one loop.
//!
//! ```
//! assert_eq!(upright_design::parallel::map(1..4, |x| x * x), [1, 4, 9]);
//! ```

use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::thread::Builder;

use rayon::prelude::*;

/// What a long computation reports.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ProgressStep<'a> {
    /// A stage with this name and number of steps begins.
    Begin(&'a str, u64),
    /// A step is done.
    Done,
    /// A step of a search is done, and has solved a candidate with this figure of merit; less is better.
    Solved(f64),
}

/// Called with each step, from any thread.
pub type Progress<'a> = &'a (dyn Fn(ProgressStep<'_>) + Sync);

/// Applies `one` to every item in parallel and returns the results in the order of the items.
pub fn map<I, T>(items: impl IntoIterator<Item = I>, one: impl Fn(I) -> T + Sync) -> Vec<T>
where
    I: Copy + Sync,
    T: Send + Sync,
{
    let items: Vec<I> = items.into_iter().collect();
    let results: Vec<OnceLock<T>> = items.iter().map(|_| OnceLock::new()).collect();
    for_each(items.len(), &|index| {
        results[index].get_or_init(|| one(items[index]));
    });
    results.into_iter().filter_map(OnceLock::into_inner).collect()
}

/// As [`map`], for computations that may fail. Once an item has failed, later items are skipped.
///
/// # Errors
/// The error of the first item that fails, in the order of the items.
pub fn try_map<I, T, E>(
    items: impl IntoIterator<Item = I>,
    one: impl Fn(I) -> Result<T, E> + Sync,
) -> Result<Vec<T>, E>
where
    I: Copy + Sync,
    T: Send + Sync,
    E: Send + Sync,
{
    let first_error = AtomicUsize::new(usize::MAX);
    let results = map(items.into_iter().enumerate(), |(index, item)| {
        let is_wanted = index < first_error.load(Relaxed);
        let result = is_wanted.then(|| one(item));
        if let Some(Err(_)) = result {
            first_error.fetch_min(index, Relaxed);
        }
        result
    });
    results.into_iter().flatten().collect()
}

/// As [`try_map`], but each call of `batch` takes up to `size` consecutive items and returns their results.
///
/// # Errors
/// The error of the first batch that fails, in the order of the items.
pub fn try_map_in_batches<I, T, E>(
    items: &[I],
    size: usize,
    batch: impl Fn(&[I]) -> Result<Vec<T>, E> + Sync,
) -> Result<Vec<T>, E>
where
    I: Sync,
    T: Send + Sync,
    E: Send + Sync,
{
    let batches: Vec<Vec<T>> = try_map(items.chunks(size.max(1)), batch)?;
    Ok(batches.into_iter().flatten().collect())
}

/// Runs two computations in parallel and returns both results.
pub fn both<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    rayon::join(a, b)
}

/// Runs `others` for 0 to `count` - 1 in a thread each, while `own` runs in this one. Where no thread can be started,
/// as in a browser, they run one after the other.
pub fn beside<A: Send, B>(
    count: u64,
    others: &(dyn Fn(u64) -> A + Sync),
    own: impl FnOnce() -> B,
) -> (Vec<A>, B) {
    std::thread::scope(|scope| {
        let start = |number| Builder::new().spawn_scoped(scope, move || others(number));
        let threads: Vec<_> = (0..count).map(start).collect();
        let own = own();
        let ended = threads.into_iter().zip(0..).map(|(thread, number)| match thread {
            Ok(thread) => thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
            Err(_) => others(number),
        });
        (ended.collect(), own)
    })
}

/// Calls `one` for 0 to `count` - 1. Each call is a separate task, because their durations may differ widely.
fn for_each(count: usize, one: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().with_max_len(1).for_each(one);
}

#[cfg(test)]
mod tests {
    use super::{map, try_map};

    #[test]
    fn results_come_in_the_order_of_the_items() {
        assert_eq!(map(0..1000, |number| number * number), (0..1000).map(|n| n * n).collect::<Vec<u64>>());
        assert_eq!(map([0; 0], |number| number), [0; 0]);
    }

    #[test]
    fn the_error_of_the_first_item_is_given_whichever_thread_is_faster() {
        let slow = |number: u32| {
            if number == 3 {
                std::thread::sleep(std::time::Duration::from_millis(20));
            }
            if number < 3 { Ok(number) } else { Err(number) }
        };
        for _ in 0..20 {
            assert_eq!(try_map(0..100, slow), Err(3));
        }
        assert_eq!(try_map(0..3, slow), Ok(vec![0, 1, 2]));
    }
}
