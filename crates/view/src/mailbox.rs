//! Between the window and a thread that works for it: the latest order one way, the latest result the other.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// What both sides hold. An order that has not been begun and a result that has not been taken give way to later ones.
pub struct Mailbox<Order, Done>(Arc<(Mutex<Slots<Order, Done>>, Condvar)>);

struct Slots<Order, Done> {
    order: Option<Order>,
    done: Option<Done>,
    busy: bool,
    closed: bool,
}

impl<Order, Done> Clone for Mailbox<Order, Done> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<Order, Done> Default for Mailbox<Order, Done> {
    fn default() -> Self {
        let empty = Slots { order: None, done: None, busy: false, closed: false };
        Self(Arc::new((Mutex::new(empty), Condvar::new())))
    }
}

impl<Order, Done> Mailbox<Order, Done> {
    /// Asks for something instead of what was asked for before and has not been begun.
    pub fn ask(&self, order: Order) {
        self.slots().order = Some(order);
        self.0.1.notify_all();
    }

    /// The latest result.
    pub fn take(&self) -> Option<Done> {
        self.slots().done.take()
    }

    /// Whether anything is asked for, worked on or waits to be taken; after a first result of several the rest does not count.
    pub fn busy(&self) -> bool {
        let slots = self.slots();
        slots.busy || slots.order.is_some() || slots.done.is_some()
    }

    /// Ends the thread that waits for orders.
    pub fn close(&self) {
        self.slots().closed = true;
        self.0.1.notify_all();
    }

    /// Waits for an order; none any more once it is closed.
    pub fn next(&self) -> Option<Order> {
        let mut slots = self.slots();
        loop {
            if slots.closed {
                return None;
            }
            if let Some(order) = slots.order.take() {
                slots.busy = true;
                return Some(order);
            }
            slots = self.0.1.wait(slots).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Gives a result.
    pub fn put(&self, done: Done) {
        let mut slots = self.slots();
        (slots.busy, slots.done) = (false, Some(done));
    }

    /// Whether something else is wanted than what is worked on.
    pub fn outdated(&self) -> bool {
        self.slots().outdated()
    }

    /// The same, once it is or after so long.
    pub fn outdated_within(&self, time: Duration) -> bool {
        let waited = self.0.1.wait_timeout_while(self.slots(), time, |slots| !slots.outdated());
        waited.unwrap_or_else(PoisonError::into_inner).0.outdated()
    }

    fn slots(&self) -> MutexGuard<'_, Slots<Order, Done>> {
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<Order, Done> Slots<Order, Done> {
    fn outdated(&self) -> bool {
        self.closed || self.order.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latest_order_is_done_and_the_latest_result_is_taken() {
        let mailbox = Mailbox::<u32, u32>::default();
        assert!(!mailbox.busy() && !mailbox.outdated() && !mailbox.outdated_within(Duration::from_millis(1)));
        mailbox.ask(1);
        mailbox.ask(2);
        assert_eq!(mailbox.next(), Some(2));
        assert!(mailbox.busy() && !mailbox.outdated());
        mailbox.ask(3);
        assert!(mailbox.outdated() && mailbox.outdated_within(Duration::from_secs(60)));
        mailbox.put(20);
        mailbox.put(21);
        assert_eq!((mailbox.take(), mailbox.take()), (Some(21), None));
        mailbox.close();
        assert!(mailbox.next().is_none() && mailbox.outdated());
    }
}
