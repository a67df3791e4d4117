//! What the calls of a relay cost on a Cortex-M4F, in instructions and bytes of stack; run by `cargo cost` in QEMU.
//!
//! QEMU with `-icount shift=10` lets 1024 ns pass with every instruction and counts SysTick at 168 MHz on this machine, so
//! the counter tells instructions. They are exact and the same in every run; cycles they are not. Results go out by
//! semihosting, which traps on a board without a debugger: this image is not one to flash.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    println!("This one runs on the target: cargo cost");
}

#[cfg(target_os = "none")]
mod target {
    use core::hint::black_box;

    use cortex_m::peripheral::SYST;
    use cortex_m_semihosting::{debug, hprintln};
    use panic_halt as _;
    use stm32f4xx_hal as _;
    use uav_relay::channel::{AirGround, Channel};
    use uav_relay::field::estimate::Estimator;
    use uav_relay::placement::levels::Levels;
    use uav_relay::placement::local::{Beside, Hops, Search};
    use uav_relay::placement::spacing::Hop;
    use uav_relay::placement::wave::{Rungs, Wave};
    use uav_relay::sir::Sender;
    use uav_relay::wire::deframe::Deframer;
    use uav_relay::wire::frame::{self, MAX_FRAME};
    use uav_relay::{
        Adjust, Band, Field, FieldPoint, FrameBuf, Identity, Instant, Interference, Interferer,
        Local, Method, Mission, MissionConfig, Phase, Placement, Port, Profile, Relay, Settings,
    };

    /// 2 GHz, excess losses of 0.1 dB and 21 dB as factors.
    const CHANNEL: Channel = match Channel::new(2e9, 1.023_293, 125.892_54, AirGround::Los) {
        Ok(channel) => channel,
        Err(_) => panic!("a channel parameter is out of range"),
    };

    const fn mission(relays: u16) -> Mission {
        Mission::new(MissionConfig {
            relays,
            distance_m: 1000.0,
            min_separation_m: 4.0,
            tx_power_w: 80.0,
            common: Profile {
                altitude_m: 20.0,
                power_w: 1.0,
            },
            channel: CHANNEL,
            band: Band::at(20.0),
            interference: Interference::Source(Interferer {
                power_w: 80.0,
                x_m: 500.0,
                y_m: 400.0,
            }),
            tolerance: 1e-4,
        })
    }

    const MISSION: Mission = mission(8);

    const INTERFERER: Interferer = Interferer {
        power_w: 80.0,
        x_m: 500.0,
        y_m: 150.0,
    };

    /// As the others, with altitudes to choose from.
    const HIGH: Mission = Mission::new(MissionConfig {
        band: Band {
            least_m: 20.0,
            most_m: 300.0,
        },
        interference: Interference::Source(INTERFERER),
        ..*mission(3).config()
    });

    const POINTS: [FieldPoint; 4] = [
        FieldPoint {
            x_m: 0.0,
            upsilon_per_w: 2.0e6,
        },
        FieldPoint {
            x_m: 300.0,
            upsilon_per_w: 5.0e6,
        },
        FieldPoint {
            x_m: 600.0,
            upsilon_per_w: 1.1e6,
        },
        FieldPoint {
            x_m: 1000.0,
            upsilon_per_w: 3.0e6,
        },
    ];

    /// As the others, in a field that is not the same everywhere.
    const UNEVEN: Mission = Mission::new(MissionConfig {
        interference: Interference::Field(Field::new(&POINTS)),
        ..*mission(3).config()
    });

    /// SysTick's largest value.
    const TOP: u32 = 0x00FF_FFFF;

    /// Ticks of SysTick in `work`.
    fn ticks<T>(work: impl FnOnce() -> T) -> u32 {
        let before = SYST::get_current();
        black_box(work());
        before.wrapping_sub(SYST::get_current()) & TOP
    }

    /// Instructions of `work`, at most 97 000; those of the measurement itself are taken off.
    fn instructions<T>(work: impl FnOnce() -> T) -> u32 {
        let empty = ticks(|| ());
        // 1024 ns at 168 MHz are 172.032 ticks.
        (ticks(work).saturating_sub(empty) * 1000 + 86_016) / 172_032
    }

    fn relay(index: u16, settings: Settings, of: Mission) -> Relay {
        let identity = Identity { network: 1, index };
        if let Ok(relay) = Relay::new(of, identity, settings, 1, Instant::ZERO) {
            return relay;
        }
        debug::exit(debug::EXIT_FAILURE);
        stop()
    }

    /// What `relay` sends next, if anything.
    fn sends(relay: &mut Relay, now: Instant) -> Option<(FrameBuf, usize)> {
        let mut frame: FrameBuf = [0; MAX_FRAME];
        let transmit = relay.poll_transmit(now, &mut frame)?;
        Some((frame, transmit.len))
    }

    fn reach() {
        let common = MISSION.config().common;
        let middle = Hop::new(
            &MISSION,
            &INTERFERER,
            Sender::relay(&MISSION, common),
            4,
            common.altitude_m,
            0.0,
        );
        let mut most = 0;
        for from in [100.0_f32, 400.0, 499.9, 500.1, 600.0, 900.0] {
            for target in [0.005_f32, 0.0125, 1.0, 5.0, 40.0] {
                let (hop, target, from) = (black_box(&middle), black_box(target), black_box(from));
                most = most.max(instructions(|| hop.reach(target, from)));
            }
        }
        hprintln!("reach {}", most);
    }

    /// A full sweep through a middle relay, and through the tail of a chain of three; the verdict on its way back.
    fn sweep() {
        const THREE: Mission = mission(3);
        let settings = Settings {
            predict: false,
            ..Settings::default()
        };
        let mut head = relay(1, settings, THREE);
        let mut middle = relay(2, settings, THREE);
        let mut tail = relay(3, settings, THREE);
        let (mut now, mut begin) = (Instant::ZERO, 0);
        while head.phase() == Phase::Planning {
            now = head.poll_timeout().unwrap_or(now);
            begin = begin.max(instructions(|| head.handle_timeout(now)));
        }
        let (mut through, mut at_tail, mut back, mut next) = (0, 0, 0, 0);
        let mut longest = 0;
        while head.phase() == Phase::Waiting {
            let Some((frame, len)) = sends(&mut head, now) else {
                break;
            };
            longest = longest.max(len);
            let bytes = frame.get(..len).unwrap_or_default();
            through = through.max(instructions(|| {
                middle.handle_bytes(now, Port::Upstream, bytes);
                let mut out: FrameBuf = [0; MAX_FRAME];
                black_box(middle.poll_transmit(now, &mut out));
                black_box(&out);
            }));
            // Once more, out of the measured path: the frame itself.
            let mut again = relay(2, settings, THREE);
            again.handle_bytes(now, Port::Upstream, bytes);
            let Some((frame, len)) = sends(&mut again, now) else {
                break;
            };
            let bytes = frame.get(..len).unwrap_or_default();
            let mut answer: FrameBuf = [0; MAX_FRAME];
            let mut answered = None;
            at_tail = at_tail.max(instructions(|| {
                tail.handle_bytes(now, Port::Upstream, bytes);
                answered = tail.poll_transmit(now, &mut answer);
            }));
            let Some(transmit) = answered else { break };
            let bytes = answer.get(..transmit.len).unwrap_or_default();
            let mut onward: FrameBuf = [0; MAX_FRAME];
            let mut passed = None;
            back = back.max(instructions(|| {
                middle.handle_bytes(now, Port::Downstream, bytes);
                passed = middle.poll_transmit(now, &mut onward);
            }));
            let Some(transmit) = passed else { break };
            let bytes = onward.get(..transmit.len).unwrap_or_default();
            next = next.max(instructions(|| {
                head.handle_bytes(now, Port::Downstream, bytes);
            }));
            if head.phase() == Phase::Answered {
                now = head.poll_timeout().unwrap_or(now);
                begin = begin.max(instructions(|| head.handle_timeout(now)));
            }
        }
        hprintln!("begin_sweep {}", begin);
        hprintln!("sweep_bytes {}", longest);
        hprintln!("sweep {}", through);
        hprintln!("sweep_at_tail {}", at_tail);
        hprintln!("verdict {}", back);
        hprintln!("verdict_at_head {}", next);
        hprintln!("settled {}", u32::from(head.phase() == Phase::Holding));
    }

    /// Bytes of stack that the calls of a relay use, at most: the stack below is painted, and the paint looked for.
    fn stack() {
        const TWO: Mission = mission(2);
        let mut head = relay(1, Settings::default(), TWO);
        let mut tail = relay(2, Settings::default(), TWO);
        let used = used_stack(|| {
            let mut now = Instant::ZERO;
            while head.phase() == Phase::Planning {
                now = head.poll_timeout().unwrap_or(now);
                head.handle_timeout(now);
            }
            exchange(&mut head, &mut tail, Port::Upstream, now);
            exchange(&mut tail, &mut head, Port::Downstream, now);
        });
        hprintln!("stack {}", used);
        hprintln!(
            "agreed {}",
            u32::from(head.setpoint().is_some() && tail.setpoint().is_some())
        );
    }

    /// Hands over what one relay has to say.
    fn exchange(from: &mut Relay, to: &mut Relay, at: Port, now: Instant) {
        let mut frame: FrameBuf = [0; MAX_FRAME];
        while let Some(transmit) = from.poll_transmit(now, &mut frame) {
            to.handle_bytes(now, at, frame.get(..transmit.len).unwrap_or_default());
        }
    }

    /// Words that are painted: more than any call uses.
    const PAINTED: usize = 1024;

    /// What untouched stack looks like.
    const PAINT: u32 = 0xC0FF_EE11;

    /// Bytes of stack that `work` uses below this frame.
    #[inline(never)]
    fn used_stack(work: impl FnOnce()) -> u32 {
        paint();
        work();
        look()
    }

    /// Paints the stack that the next call will use, by using it.
    #[inline(never)]
    fn paint() {
        let mut words = [0_u32; PAINTED];
        for word in &mut words {
            *word = black_box(PAINT);
        }
        black_box(&words);
    }

    /// How much of the paint is gone, in bytes. The array is laid where that of `paint` was, and not written.
    #[inline(never)]
    fn look() -> u32 {
        let words = core::mem::MaybeUninit::<[u32; PAINTED]>::uninit();
        let first = black_box(words.as_ptr().cast::<u32>());
        let untouched = (0..PAINTED)
            // SAFETY: inside the array; that it may hold anything is the point, and volatile reads take it as it is.
            .take_while(|at| unsafe { first.add(*at).read_volatile() } == PAINT)
            .count();
        u32::try_from(4 * (PAINTED - untouched)).unwrap_or(u32::MAX)
    }

    /// A full frame through the deframer and the checks.
    fn deframe() {
        let settings = Settings {
            predict: false,
            ..Settings::default()
        };
        let mut head = relay(1, settings, MISSION);
        let mut now = Instant::ZERO;
        while head.phase() == Phase::Planning {
            now = head.poll_timeout().unwrap_or(now);
            head.handle_timeout(now);
        }
        let Some((frame, len)) = sends(&mut head, now) else {
            return;
        };
        let bytes = black_box(frame.get(..len).unwrap_or_default());
        let mut deframer = Deframer::new();
        let cost = instructions(|| {
            let mut sound = false;
            for &byte in bytes {
                if let Some(Ok(plain)) = deframer.push(byte) {
                    sound = frame::open(plain).is_ok();
                }
            }
            sound
        });
        hprintln!("frame {}", cost);
    }

    /// A chain of three that settles on its own terms, and what its calls cost.
    struct Flight {
        relays: [Relay; 3],
        /// The costliest call, and the longest frame.
        most: u32,
        longest: usize,
    }

    impl Flight {
        fn new(mission: Mission, settings: Settings) -> Self {
            Self {
                relays: [1, 2, 3].map(|index| relay(index, settings, mission)),
                most: 0,
                longest: 0,
            }
        }

        /// Delivers what relay `at` has to say.
        fn drain(&mut self, at: usize, now: Instant) {
            let mut frame: FrameBuf = [0; MAX_FRAME];
            loop {
                let Some(sender) = self.relays.get_mut(at) else {
                    return;
                };
                let mut sent = None;
                let cost = instructions(|| sent = sender.poll_transmit(now, &mut frame));
                self.most = self.most.max(cost);
                let Some(transmit) = sent else { return };
                self.longest = self.longest.max(transmit.len);
                let (to, port) = match transmit.port {
                    Port::Upstream => (at.wrapping_sub(1), Port::Downstream),
                    _ => (at + 1, Port::Upstream),
                };
                let bytes = frame.get(..transmit.len).unwrap_or_default();
                if let Some(receiver) = self.relays.get_mut(to) {
                    let cost = instructions(|| receiver.handle_bytes(now, port, bytes));
                    self.most = self.most.max(cost);
                }
            }
        }

        /// Until all hold their places, or for `turns` turns.
        fn settle(&mut self, turns: u32) -> bool {
            let mut now = Instant::ZERO;
            for _ in 0..turns {
                // Twice, so that what a relay says in return is heard.
                for at in [0, 1, 2, 1, 0] {
                    self.drain(at, now);
                }
                if self
                    .relays
                    .iter()
                    .all(|relay| relay.phase() == Phase::Holding)
                {
                    return true;
                }
                let Some(next) = self.relays.iter().filter_map(Relay::poll_timeout).min() else {
                    continue;
                };
                now = next;
                for relay in &mut self.relays {
                    if relay.poll_timeout().is_some_and(|at| at <= now) {
                        let cost = instructions(|| relay.handle_timeout(now));
                        self.most = self.most.max(cost);
                    }
                }
            }
            false
        }
    }

    #[inline(never)]
    fn methods() {
        let settings = Settings {
            predict: false,
            ..Settings::default()
        };
        let mut climb = Flight::new(
            HIGH,
            Settings {
                method: Method::Altitude,
                ..settings
            },
        );
        hprintln!("altitude_settled {}", u32::from(climb.settle(20_000)));
        hprintln!("altitude {}", climb.most);
        hprintln!("wave_bytes {}", climb.longest);
        let mut survey = Flight::new(
            HIGH,
            Settings {
                method: Method::Altitude,
                ..Settings::default()
            },
        );
        hprintln!("survey_settled {}", u32::from(survey.settle(20_000)));
        hprintln!("survey {}", survey.most);
        let adjust = Adjust {
            rounds: 2,
            ..Adjust::default()
        };
        let mut turns = Flight::new(
            HIGH,
            Settings {
                method: Method::Adjust(adjust),
                ..settings
            },
        );
        hprintln!("adjust_settled {}", u32::from(turns.settle(20_000)));
        hprintln!("adjust {}", turns.most);
        let mut field = Flight::new(UNEVEN, Settings::default());
        hprintln!("field_settled {}", u32::from(field.settle(20_000)));
        hprintln!("field {}", field.most);
    }

    /// A wave of sixteen levels and four targets, and a tube, through a middle relay; the local search of Algorithm 2.
    fn shares() {
        let common = HIGH.config().common;
        let band = HIGH.config().band;
        let mut wave = Wave::new(&HIGH);
        for (name, levels, count) in [
            ("wave_16", Levels::even(band, 16), 4),
            ("tube", Levels::tube(100.0, 20.0), 7),
            ("wave_64", Levels::even(band, 64), 1),
        ] {
            wave.begin(&HIGH, Rungs::new(0.7, 0.1, count), levels);
            while !wave.step(&HIGH, &INTERFERER, 1, 64) {}
            wave.hand_over(&HIGH, common.power_w);
            let (mut all, mut done) = (0, false);
            while !done {
                all += instructions(|| done = wave.step(&HIGH, &INTERFERER, 2, 96));
            }
            hprintln!("{} {}", name, all);
        }
        hprintln!("size_of_wave {}", size_of::<Wave>());
        let place = |x_m, altitude_m| Placement { x_m, altitude_m };
        let beside = |place| Beside {
            place,
            apart_m: 4.0,
        };
        let gain = HIGH.relay_gain(1.0);
        let (before, after) = (place(250.0, 100.0), place(320.0, 110.0));
        let hops = Hops::new(
            &HIGH,
            &INTERFERER,
            beside(before),
            gain,
            1.0,
            Some(beside(after)),
        );
        let hops = black_box(hops);
        let at = black_box(place(280.0, 104.0));
        hprintln!(
            "evaluation {}",
            instructions(|| black_box(&hops).worse(black_box(at)))
        );
        let mut search = Search::new(Local::Fine, hops, at, 10.0, (20.0, 300.0));
        let (mut all, mut over) = (0, false);
        while !over {
            all += instructions(|| over = search.step(240).is_ready());
        }
        hprintln!("search {}", all);
        hprintln!("size_of_search {}", size_of::<Search>());
        let mut estimator = Estimator::new(1e-6);
        let mut push = 0;
        for at in 1..=1000_u16 {
            let power_w = black_box(1e-9 * f32::from(at));
            push = push.max(instructions(|| estimator.push(power_w)));
        }
        hprintln!("sample {}", push);
        hprintln!("estimate {}", instructions(|| estimator.estimate()));
    }

    /// The largest portion of the head's prediction, and how many it takes for a hundred relays.
    fn predict() {
        const HUNDRED: Mission = mission(100);
        let mut head = relay(1, Settings::default(), HUNDRED);
        let (mut most, mut portions) = (0, 0);
        while head.phase() == Phase::Planning {
            let now = head.poll_timeout().unwrap_or(Instant::ZERO);
            most = most.max(instructions(|| head.handle_timeout(now)));
            portions += 1;
        }
        hprintln!("predict {}", most);
        hprintln!("predict_portions {}", portions);
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        if let Some(mut peripherals) = cortex_m::Peripherals::take() {
            peripherals
                .SYST
                .set_clock_source(cortex_m::peripheral::syst::SystClkSource::Core);
            peripherals.SYST.set_reload(TOP);
            peripherals.SYST.clear_current();
            peripherals.SYST.enable_counter();
        }
        hprintln!("size_of_relay {}", size_of::<Relay>());
        reach();
        deframe();
        sweep();
        predict();
        shares();
        methods();
        stack();
        hprintln!("done 1");
        debug::exit(debug::EXIT_SUCCESS);
        stop()
    }

    /// Where the program ends should QEMU not take its leave.
    fn stop() -> ! {
        loop {
            cortex_m::asm::wfi();
        }
    }
}
