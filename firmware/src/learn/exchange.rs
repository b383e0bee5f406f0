//! Between the frame path and the learner, which has a priority of its own.
//!
//! The frame path hands [`Order`]s over in the order in which their causes come, and reads an
//! [`Answer`] at the end of each block. The learner carries the orders out one after the other,
//! however long that takes, and answers each block once.
//!
//! ```text
//! samples of block n, fixes | end of block n |     block n + 1     | end of block n + 1
//!                             order Block(n)   the learner works     answer(n) in force
//! ```
//!
//! **The answer to block n comes into force at the end of block n + 1**, so it acts on the samples
//! of block n + 2: as late whether the learner took a microsecond or nearly a block. So the same
//! input gives the same bits whoever runs the learner: the caller itself ([`Here`]: desktop,
//! tests), or another priority behind queues ([`Ends`]: boards). A learner whose answer is not
//! there in time, or whose queue is full, is stopped and reported; the stream goes on.
//!
//! What can be looked at ([`View`]) is newer: it comes with each answer, and changes nothing.

mod messages;

pub use messages::{Answer, Order, Reply, RestartReason, View};

use super::Learner;
use crate::compensator::Block;
use crate::link::spsc::{Consumer, Producer, Queue};
use crate::sample::RawSample;

/// Samples and gaps that can wait: 64 ms at 2000 Hz.
pub const SAMPLES: usize = 128;
/// Other orders that can wait.
const OTHERS: usize = 8;
const REPLIES: usize = 2;

/// Result of an order.
#[expect(clippy::large_enum_variant, reason = "there is no heap")]
enum Outcome {
    Nothing,
    View,
    Answer(Answer),
    Reply(Reply),
}

/// Carries an order out.
fn carry_out(order: &Order, learner: &mut dyn Learner) -> Outcome {
    match order {
        Order::Sample(number, sample) => learner.sample(*number, sample),
        Order::Gap => learner.gap(),
        Order::Fix(number, fix) => learner.fix(*number, fix),
        Order::WheelSpeed(number, speed) => learner.wheel_speed(*number, speed),
        Order::Align(alignment) => learner.align(*alignment),
        Order::Block(number, last, block) => {
            learner.block(*last, block);
            return Outcome::Answer(Answer::of(learner, *number));
        }
        Order::Restart(reason) => {
            match reason {
                RestartReason::Configured {
                    settings,
                    same_unit,
                } => {
                    if !same_unit {
                        learner.recall(&[]);
                    }
                    learner.configure(settings);
                }
                RestartReason::Begin(nets, stream) => learner.begin(nets, *stream),
                RestartReason::Stream => learner.restart(),
                RestartReason::Silence => learner.silence(),
                RestartReason::Drive => learner.next_drive(),
            }
            return Outcome::View;
        }
        Order::Heading(number, heading) => {
            return Outcome::Reply(Reply::Verdict(*number, learner.heading(*heading)));
        }
        Order::Reference(number, window) => {
            return Outcome::Reply(Reply::Verdict(*number, learner.reference(window)));
        }
        Order::Remember => return Outcome::Reply(Reply::Remembered(learner.remember())),
    }
    Outcome::Nothing
}

/// A learner that the caller itself runs, within the call that hands an order over.
pub struct Here<'m> {
    learner: &'m mut dyn Learner,
    answer: Option<Answer>,
    view: View,
    reply: Option<Reply>,
}

impl<'m> Here<'m> {
    /// The end with this learner.
    pub fn new(learner: &'m mut dyn Learner) -> Here<'m> {
        Here {
            view: View::of(learner),
            learner,
            answer: None,
            reply: None,
        }
    }

    /// The learner.
    pub fn learner(&self) -> &dyn Learner {
        self.learner
    }

    /// Before the first order: what is known of the unit.
    pub fn recall(&mut self, memory: &[u8]) {
        self.learner.recall(memory);
    }

    fn hand_over(&mut self, order: &Order) {
        match carry_out(order, self.learner) {
            Outcome::Nothing => return,
            Outcome::View => {}
            Outcome::Answer(answer) => self.answer = Some(answer),
            Outcome::Reply(reply) => self.reply = Some(reply),
        }
        self.view = View::of(self.learner);
    }
}

/// A frequent order, or the next of the other orders.
#[derive(Debug, Clone, Copy)]
enum Next {
    Sample(u32, RawSample),
    Gap,
    Other,
}

/// The queues between two priorities, to be static.
#[derive(Debug)]
pub struct Exchange {
    next: Queue<Next, SAMPLES>,
    others: Queue<Order, OTHERS>,
    answers: Queue<Answer, 1>,
    views: Queue<View, 1>,
    replies: Queue<Reply, REPLIES>,
}

impl Exchange {
    /// Empty.
    #[expect(clippy::new_without_default, reason = "it is for statics")]
    pub const fn new() -> Exchange {
        Exchange {
            next: Queue::new(),
            others: Queue::new(),
            answers: Queue::new(),
            views: Queue::new(),
            replies: Queue::new(),
        }
    }

    /// Both ends: of the frame path, and of the priority that runs `here`'s learner.
    pub fn split<'m>(&'m mut self, here: Here<'m>) -> (Ends<'m>, Background<'m>) {
        let (next_in, next_out) = self.next.split();
        let (others_in, others_out) = self.others.split();
        let (answers_in, answers_out) = self.answers.split();
        let (views_in, views_out) = self.views.split();
        let (replies_in, replies_out) = self.replies.split();
        let ends = Ends {
            next: next_in,
            others: others_in,
            answers: answers_out,
            views: views_out,
            view: here.view,
            replies: replies_out,
        };
        let background = Background {
            learner: here.learner,
            next: next_out,
            others: others_out,
            answers: answers_in,
            views: views_in,
            replies: replies_in,
        };
        (ends, background)
    }
}

/// The frame path's side of an [`Exchange`].
pub struct Ends<'m> {
    next: Producer<'m, Next, SAMPLES>,
    others: Producer<'m, Order, OTHERS>,
    answers: Consumer<'m, Answer, 1>,
    views: Consumer<'m, View, 1>,
    view: View,
    replies: Consumer<'m, Reply, REPLIES>,
}

impl Ends<'_> {
    /// False: there is no room.
    fn hand_over(&mut self, order: &Order) -> bool {
        match order {
            Order::Sample(number, sample) => self.next.put(Next::Sample(*number, *sample)),
            Order::Gap => self.next.put(Next::Gap),
            other => self.next.has_room() && self.others.put(*other) && self.next.put(Next::Other),
        }
    }
}

/// The learner's side of an [`Exchange`].
pub struct Background<'m> {
    learner: &'m mut dyn Learner,
    next: Consumer<'m, Next, SAMPLES>,
    others: Consumer<'m, Order, OTHERS>,
    answers: Producer<'m, Answer, 1>,
    views: Producer<'m, View, 1>,
    replies: Producer<'m, Reply, REPLIES>,
}

impl core::fmt::Debug for Background<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Background")
    }
}

impl Background<'_> {
    /// Carries out the next order. False: none waits.
    pub fn turn(&mut self) -> bool {
        let order = match self.next.take() {
            None => return false,
            Some(Next::Sample(number, sample)) => Some(Order::Sample(number, sample)),
            Some(Next::Gap) => Some(Order::Gap),
            Some(Next::Other) => self.others.take(),
        };
        let Some(order) = order else {
            return true;
        };
        // an answer that finds no room is missed, and so the learner is stopped
        match carry_out(&order, self.learner) {
            Outcome::Nothing => return true,
            Outcome::View => {}
            Outcome::Answer(answer) => _ = self.answers.put(answer),
            Outcome::Reply(reply) => _ = self.replies.put(reply),
        }
        let _ = self.views.put(View::of(self.learner)); // one that is not taken is old anyway
        true
    }

    /// An order waits.
    pub fn waits(&self) -> bool {
        self.next.waits()
    }

    /// The learner, for what it has taken down.
    pub fn learner(&self) -> &dyn Learner {
        self.learner
    }
}

/// How the learner is run.
#[expect(clippy::large_enum_variant, reason = "there is no heap")]
enum Runs<'m> {
    Nobody,
    Here(Here<'m>),
    Apart(Ends<'m>),
}

/// The frame path's view of the learner.
pub struct Port<'m> {
    runs: Runs<'m>,
    /// Number of the last block that was handed over, and whether its answer is awaited.
    number: u32,
    awaits: bool,
    /// The answer in force.
    answer: Option<Answer>,
    /// The learner fell behind.
    stopped: bool,
    /// A configuration that a stopped learner has not had, and whether it is of the same unit.
    owes: Option<bool>,
}

impl core::fmt::Debug for Port<'_> {
    /// Omits the learner's numbers, which would bring the formatting of floats into every image.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self.runs {
            Runs::Nobody => "None",
            Runs::Here(_) => "Here",
            Runs::Apart(_) => "Apart",
        })
    }
}

impl<'m> Port<'m> {
    /// A port without a learner.
    pub const NONE: Port<'m> = Port {
        runs: Runs::Nobody,
        number: 0,
        awaits: false,
        answer: None,
        stopped: false,
        owes: None,
    };

    /// A port to a learner that is run at once.
    pub fn here(learner: Option<&'m mut dyn Learner>) -> Port<'m> {
        Port {
            runs: learner.map_or(Runs::Nobody, |learner| Runs::Here(Here::new(learner))),
            ..Port::NONE
        }
    }

    /// From now on the learner is run by whoever has the [`Background`]. `None`: there is no
    /// learner, or it is apart already.
    pub fn split(&mut self, exchange: &'m mut Exchange) -> Option<Background<'m>> {
        match core::mem::replace(&mut self.runs, Runs::Nobody) {
            Runs::Here(here) => {
                let (ends, background) = exchange.split(here);
                self.runs = Runs::Apart(ends);
                Some(background)
            }
            runs => {
                self.runs = runs;
                None
            }
        }
    }

    /// Whether there is a learner.
    pub fn exists(&self) -> bool {
        !matches!(self.runs, Runs::Nobody)
    }

    /// The learner fell behind and has no part in what goes on.
    pub fn is_stopped(&self) -> bool {
        self.stopped
    }

    /// Hands an order over; not to a learner that was stopped.
    pub fn hand_over(&mut self, order: &Order) {
        if self.stopped {
            return;
        }
        match &mut self.runs {
            Runs::Nobody => {}
            Runs::Here(here) => here.hand_over(order),
            Runs::Apart(ends) => self.stopped = !ends.hand_over(order),
        }
    }

    /// Whether the learner has missed a configuration: [`RestartReason::Configured`] must come
    /// first.
    pub fn owes_configuration(&self) -> bool {
        self.owes.is_some()
    }

    /// Restarts the learner. Its earlier results do not count any more. One that has missed a
    /// configuration stays stopped until it has that.
    pub fn restart_learner(&mut self, mut reason: RestartReason) {
        (self.answer, self.awaits) = (None, false);
        let owed = self.owes.take();
        self.stopped &= !self.has_caught_up();
        let configured = match &mut reason {
            RestartReason::Configured { same_unit, .. } => {
                *same_unit &= owed.unwrap_or(true);
                Some(*same_unit)
            }
            _ => owed.inspect(|_| self.stopped = true),
        };
        self.hand_over(&Order::Restart(reason));
        self.owes = configured.filter(|_| self.stopped);
    }

    /// Takes what can be looked at. To be called in every pass.
    pub fn look(&mut self) {
        if let Runs::Apart(ends) = &mut self.runs {
            while let Some(view) = ends.views.take() {
                ends.view = view;
            }
        }
    }

    /// A block has ended: the answer to the one before comes into force.
    /// [`Port::hand_over_block`] follows.
    pub fn end_block(&mut self) {
        let (mut answer, number) = (None, self.number);
        while let Some(next) = self.next_answer() {
            answer = Some(next).filter(|next| next.number == number);
        }
        if core::mem::take(&mut self.awaits) && !self.stopped {
            self.stopped = answer.is_none();
            self.answer = answer.or(self.answer);
        }
    }

    fn next_answer(&mut self) -> Option<Answer> {
        match &mut self.runs {
            Runs::Nobody => None,
            Runs::Here(here) => here.answer.take(),
            Runs::Apart(ends) => ends.answers.take(),
        }
    }

    /// The block that has ended, and the number of its last sample.
    pub fn hand_over_block(&mut self, last: u32, block: &Block) {
        self.number = self.number.wrapping_add(1);
        self.awaits = true;
        self.hand_over(&Order::Block(self.number, last, *block));
    }

    /// Reply to an order, once.
    pub fn reply(&mut self) -> Option<Reply> {
        match &mut self.runs {
            Runs::Nobody => None,
            Runs::Here(here) => here.reply.take(),
            Runs::Apart(ends) => ends.replies.take(),
        }
    }

    /// The answer in force.
    pub fn answer(&self) -> Option<&Answer> {
        self.answer.as_ref()
    }

    /// The learner's state; `None` without a learner.
    pub fn view(&self) -> Option<&View> {
        match &self.runs {
            Runs::Nobody => None,
            Runs::Here(here) => Some(&here.view),
            Runs::Apart(ends) => Some(&ends.view),
        }
    }

    /// The learner of [`Port::here`].
    pub fn learner(&self) -> Option<&dyn Learner> {
        match &self.runs {
            Runs::Here(here) => Some(here.learner()),
            Runs::Nobody | Runs::Apart(_) => None,
        }
    }

    /// Before the first order, by [`Port::here`]: what is known of the unit.
    pub fn recall(&mut self, memory: &[u8]) {
        if let Runs::Here(here) = &mut self.runs {
            here.recall(memory);
        }
    }

    /// All that was handed over is carried out.
    fn has_caught_up(&self) -> bool {
        match &self.runs {
            Runs::Nobody | Runs::Here(_) => true,
            Runs::Apart(ends) => ends.next.is_empty(),
        }
    }
}
