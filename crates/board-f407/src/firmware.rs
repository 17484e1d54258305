//! Starts the board and runs the step interrupt. No serial line yet: the button moves the motors there and back.
use crate::{
    step_port::{Port, TIMER_HZ},
    wiring::{MOTORS, POWER_HZ},
};
use core::num::NonZeroU16;
use defmt_rtt as _;
use heapless::spsc::{Consumer, Producer, Queue};
use leadscrew_stepper::{
    on_timer, Interval, IntervalChange, Line, LineError, Outputs, Power, PowerChange, Segment,
    Shared, Smoothing, StepInterrupt,
};
use panic_probe as _;
use stm32f4xx_hal::{
    gpio::{Edge, Input, Pin},
    prelude::*,
    rcc::Config,
};

/// Frequency of the board's crystal in Hz (STM32F4-Discovery, UM1472).
const CRYSTAL_HZ: u32 = 8_000_000;
/// CPU clock in Hz, the highest that the STM32F407 allows (its data sheet, DocID022152, table 14).
const CPU_HZ: u32 = 168_000_000;
/// Step rate of the demonstration in steps/s: slow enough for a motor to start without a ramp.
const STEP_RATE: u32 = 800;
/// Steps of each motor in a demonstration: one turn of the first at 8 microsteps.
const STEPS: [i32; MOTORS] = [1600, 800, -400];

/// Segments waiting for the step interrupt, and one place that the queue needs for itself.
type Segments = Queue<Segment<MOTORS>, 17>;

static SHARED: Shared<MOTORS> = Shared::new();

#[rtic::app(device = stm32f4xx_hal::pac, peripherals = true)]
mod app {
    use super::*;

    #[shared]
    struct SharedResources {}

    #[local]
    struct Local {
        port: Port,
        source: Consumer<'static, Segment<MOTORS>>,
        sink: Producer<'static, Segment<MOTORS>>,
        button: Pin<'A', 0, Input>,
    }

    #[init(local = [segments: Segments = Queue::new()])]
    fn init(cx: init::Context) -> (SharedResources, Local) {
        let device = cx.device;
        let clocks = Config::hse(CRYSTAL_HZ.Hz()).sysclk(CPU_HZ.Hz());
        let mut rcc = device.RCC.freeze(clocks);
        defmt::info!("leadscrew: CPU at {} Hz", rcc.clocks.sysclk().raw());

        let motors = device.GPIOE.split(&mut rcc);
        motors.pe7.into_push_pull_output();
        motors.pe8.into_push_pull_output();
        motors.pe9.into_push_pull_output();
        motors.pe10.into_push_pull_output();
        motors.pe11.into_push_pull_output();
        motors.pe12.into_push_pull_output();

        let led = device.GPIOD.split(&mut rcc).pd12;
        let (_, (power, ..)) = device.TIM4.pwm_hz(POWER_HZ.Hz(), &mut rcc);
        let port = Port::new(device.TIM2, power.with(led), &mut rcc);

        let mut button = device.GPIOA.split(&mut rcc).pa0.into_input();
        let (mut exti, mut syscfg) = (device.EXTI, device.SYSCFG.constrain(&mut rcc));
        button.make_interrupt_source(&mut syscfg);
        button.trigger_on_edge(&mut exti, Edge::Rising);
        button.enable_interrupt(&mut exti);

        let (sink, source) = cx.local.segments.split();
        (
            SharedResources {},
            Local {
                port,
                source,
                sink,
                button,
            },
        )
    }

    /// The step interrupt. Above everything else, so that nothing delays a step.
    #[task(binds = TIM2, priority = 16, local = [port, source, state: StepInterrupt<MOTORS> = StepInterrupt::new()])]
    fn step(cx: step::Context) {
        let step::LocalResources {
            port,
            source,
            state,
            ..
        } = cx.local;
        if port.acknowledge(&SHARED) {
            on_timer(state, source, &SHARED, port);
        }
    }

    /// The button: starts a demonstration where none is under way.
    #[task(binds = EXTI0, priority = 1, local = [sink, button, back: bool = false])]
    fn press(cx: press::Context) {
        cx.local.button.clear_interrupt_pending_bit();
        if SHARED.is_running() {
            return;
        }
        let steps = if *cx.local.back {
            STEPS.map(|count| -count)
        } else {
            STEPS
        };
        match demonstration(steps) {
            Ok(segment) if cx.local.sink.enqueue(segment).is_ok() => {
                *cx.local.back = !*cx.local.back;
                SHARED.set_running();
                rtic::pend(stm32f4xx_hal::pac::Interrupt::TIM2);
            }
            Ok(_) => defmt::warn!("no room for another segment"),
            Err(_) => defmt::warn!("the demonstration is no line"),
        }
    }
}

/// One line at a constant rate and half power.
fn demonstration(steps: [i32; MOTORS]) -> Result<Segment<MOTORS>, LineError> {
    let line = Line::new(steps)?;
    let ticks = u16::try_from(line.step_events().get()).map_err(|_| LineError::TooLong)?;
    Ok(Segment {
        line: Some(line),
        ticks: NonZeroU16::new(ticks).ok_or(LineError::NoSteps)?,
        smoothing: Smoothing::None,
        interval: Interval::from_num(TIMER_HZ / STEP_RATE),
        interval_change: IntervalChange::ZERO,
        power: Power::from_share(fixed::types::U1F31::from_num(0.5)),
        power_change: PowerChange::ZERO,
        outputs: Outputs(0),
        at_rest: Some(Power::OFF),
    })
}
