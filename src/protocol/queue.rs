//! Single-producer, single-consumer queues between tasks, without a path to a panic.
//!
//! The queues of `heapless` divide by their length, which they store at run time, so the compiler keeps the panic of a
//! division by 0. No queue has the length 0; these functions check it, and the compiler removes the panic.

use heapless::spsc::{Consumer, Producer};

/// Adds `item` to the queue.
///
/// # Errors
/// The item, if the queue is full.
#[inline]
pub fn put<T>(queue: &mut Producer<'_, T>, item: T) -> Result<(), T> {
    if is_sound(queue.capacity()) { queue.enqueue(item) } else { Err(item) }
}

/// Removes and returns the oldest item, if there is one.
#[inline]
pub fn take<T>(queue: &mut Consumer<'_, T>) -> Option<T> {
    if is_sound(queue.capacity()) { queue.dequeue() } else { None }
}

/// Whether the length is not 0; the capacity is the length less one.
#[inline]
fn is_sound(capacity: usize) -> bool {
    capacity != usize::MAX
}
