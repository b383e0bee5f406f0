//! The start of a board with its store.

use super::App;
use crate::app::hardware::Hardware;
use crate::learn::Learner;
use crate::store::{MEMORY_MAX, Store};
use embedded_storage::nor_flash::NorFlash;

impl<'m> App<'m> {
    /// [`App::boot`] of an application that is returned.
    pub fn start_up<F: NorFlash>(
        hardware: Hardware,
        store: &mut Option<Store<F>>,
        at_ease: bool,
        learner: Option<&'m mut dyn Learner>,
    ) -> App<'m> {
        let mut app = App::blank();
        app.boot(hardware, store, at_ease, learner);
        app
    }

    /// Reads the store and begins with it ([`App::power_on`], [`App::recall`]), after
    /// [`App::blank`].
    ///
    /// `at_ease`: the board was switched on and its clock is fast, so there is time to make room in
    /// the store. Else a sensor may be waiting, and nothing is erased. Nothing is erased in a safe
    /// start either.
    ///
    /// A safe start after a crash that came before the first pass leaves the store alone, since it
    /// may be the store that cannot be read: flash with check bits faults where a word is torn. The
    /// store is then `None` for this run.
    pub fn boot<F: NorFlash>(
        &mut self,
        hardware: Hardware,
        store: &mut Option<Store<F>>,
        at_ease: bool,
        learner: Option<&'m mut dyn Learner>,
    ) {
        if hardware.shuns_store() {
            *store = None;
        }
        let safe = hardware.starts_safely();
        self.read(hardware, store, at_ease && !safe, learner);
        if !safe && let Some(store) = store {
            recall(self, store);
        }
    }

    /// Number of the record that was found at power-on; `None`: none was, or not one that this
    /// firmware understands.
    #[must_use]
    pub fn stored_number(&self) -> Option<u32> {
        self.commands.server.store_report.generation
    }

    /// Apart, like [`recall`], so that the stack does not hold both.
    #[inline(never)]
    fn read<F: NorFlash>(
        &mut self,
        hardware: Hardware,
        store: &mut Option<Store<F>>,
        at_ease: bool,
        learner: Option<&'m mut dyn Learner>,
    ) {
        if let Some(store) = store {
            store.started(hardware.has_failed());
            if at_ease {
                let _ = store.make_room(); // fault STORE reports it when the next record finds none
            }
        }
        let stored = store.as_mut().map(Store::load);
        self.switch_on(hardware, stored, learner);
    }
}

#[inline(never)]
fn recall<F: NorFlash>(app: &mut App, store: &mut Store<F>) {
    let mut memory = [0; MEMORY_MAX];
    let len = store.memory(&mut memory);
    app.recall(memory.get(..len).unwrap_or_default());
    app.flow.pending.unit_memory.left = store.left();
}
