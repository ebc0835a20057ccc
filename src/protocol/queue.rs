//! Single-producer, single-consumer queues between tasks, without a path to a panic.
//!
//! The queues of `heapless` divide by their length, which they keep at run time, and the compiler keeps the panic of a
//! division by 0. A queue is never of length 0; these functions say so.

use heapless::spsc::{Consumer, Producer};

/// Puts `item` into the queue.
///
/// # Errors
/// The item, if the queue is full.
#[inline]
pub fn put<T>(queue: &mut Producer<'_, T>, item: T) -> Result<(), T> {
    if is_sound(queue.capacity()) { queue.enqueue(item) } else { Err(item) }
}

/// Takes the oldest item.
#[inline]
pub fn take<T>(queue: &mut Consumer<'_, T>) -> Option<T> {
    if is_sound(queue.capacity()) { queue.dequeue() } else { None }
}

/// The capacity is the length less one.
#[inline]
fn is_sound(capacity: usize) -> bool {
    capacity != usize::MAX
}
