// An image of the Pico on rp2040js, an emulator that shares no code with this project, with what a run on the model of
// the chip gave it: the encoder's counts at each sample, and the host's bytes. Each code that it puts out must be that
// run's. `node replay.mjs IMAGE REQUESTS ANSWERS`; docs/firmware.md says how the files are made.
import { readFileSync } from "node:fs";
import { ConsoleLogger, LogLevel, RP2040 } from "rp2040js";

const FLASH = 0x10000000;
const LOADER = 0x20041f00;
const CORE_NS = 8; // 125 MHz
const PASS = 10; // clocks in which the counter of edges has seen one
const SETTLING = 3; // periods before the first sample
const [A, B] = [2, 3]; // pins of the encoder
const SWITCH = 17; // and of the switch behind the filter
const STATES = [0b00, 0b01, 0b11, 0b10]; // B and A, in the order of rising counts
const SAMPLED = 1;

/** The samples of the recorded run: counts, the code after them, and the bytes that came until the next. */
function recorded(requests, answers) {
  const samples = [];
  for (let asked = 0, told = 0; told < answers.length; ) {
    const counts = requests.readInt32LE(asked + 8);
    const length = requests.readUInt16LE(asked + 16);
    if (answers.readUInt16LE(told + 10) & SAMPLED) samples.push({ counts, bytes: [] });
    const last = samples.at(-1);
    if (last) {
      last.code = answers.readUInt16LE(told + 8);
      last.bytes.push(...requests.subarray(asked + 18, asked + 18 + length));
    }
    asked += 18 + length;
    told += 18 + answers.readUInt16LE(told + 16);
  }
  return samples;
}

/** A chip with an image in its flash, as its own loader leaves it. */
function powered(image) {
  const chip = new RP2040();
  chip.logger = new ConsoleLogger(LogLevel.Error, true);
  for (let n = 0, size = image.readUInt16LE(42); n < image.readUInt16LE(44); n++) {
    const at = image.readUInt32LE(28) + n * size;
    const [kind, from, , lies, length] = [0, 4, 8, 12, 16].map((field) => image.readUInt32LE(at + field));
    if (kind === 1 && length) chip.flash.set(image.subarray(from, from + length), lies - FLASH);
  }
  // The noise of the ring oscillator as the model of the chip has it: the number of the power-up is made of it.
  let noise = 0x9e3779b9;
  chip.peripherals[0x40060].readUint32 = () => {
    noise ^= noise << 13;
    noise ^= noise >>> 17;
    noise ^= noise << 5;
    return noise & 1;
  };
  chip.sram.set(chip.flash.subarray(0, 256), LOADER - 0x20000000);
  chip.core.SP = chip.core.PC = LOADER;
  chip.core.LR = 0;
  return chip;
}

const [image, requests, answers] = process.argv.slice(2).map((name) => readFileSync(name));
const samples = recorded(requests, answers);
const chip = powered(image);
const { core, clock } = chip;
let instructions = 0;
let sent = 0;
let resets = 0;
chip.uart[0].onByte = () => sent++;
chip.peripherals[0x40058].onWatchdogTrigger = () => resets++;

// The counter of edges in step with edges and with the core's looks at it, not with the time of this machine.
const pio = chip.pio[0];
const pass = () => {
  for (let n = 0; n < PASS && !pio.stopped; n++) pio.machines[0].step();
};
const read = pio.readUint32.bind(pio);
pio.run = () => {};
pio.readUint32 = (offset) => {
  if (offset === 0x04 || offset === 0x0c) pass(); // FSTAT, FLEVEL
  return read(offset);
};

/** The core runs until it sleeps with nothing to do. */
function work() {
  for (;;) {
    if (core.waiting) {
      if (!(core.pendingInterrupts & core.enabledInterrupts) || !core.checkForInterrupts()) return;
      core.waiting = false;
    }
    clock.tick(core.executeInstruction() * CORE_NS);
    instructions++;
  }
}

/** Time goes on until the core has something to do. */
function sleep() {
  while (core.waiting) clock.tick(clock.nanosToNextAlarm);
}

let encoder = 0;
function turn(counts) {
  while (encoder !== counts) {
    encoder += Math.sign(counts - encoder);
    const state = STATES[encoder & 3];
    chip.gpio[A].setInputValue((state & 1) !== 0);
    chip.gpio[B].setInputValue((state & 2) !== 0);
    pass();
  }
}

work();
for (let n = 0; n < SETTLING; n++) {
  sleep();
  work();
}
console.log(`started after ${(clock.nanos / 1e6).toFixed(1)} ms`);
let different = 0;
const spent = { instructions: [], us: [] };
samples.forEach((sample, n) => {
  turn(sample.counts);
  sleep();
  const [before, woke] = [instructions, clock.nanos];
  work();
  if (!sample.bytes.length) {
    spent.instructions.push(instructions - before);
    spent.us.push((clock.nanos - woke) / 1e3);
  }
  for (const byte of sample.bytes) {
    if (chip.uart[0].rxFIFO.full) work();
    chip.uart[0].feedByte(byte);
  }
  work();
  const code = chip.pwm.channels[0].cc & 0xffff;
  if (code !== sample.code && different++ === 0) {
    console.log(`sample ${n}: code ${code}, on the model of the chip ${sample.code}`);
  }
});
for (const [what, numbers] of Object.entries(spent)) {
  const mean = numbers.reduce((sum, number) => sum + number, 0) / numbers.length;
  console.log(`a period: ${mean.toFixed(1)} ${what} on average, ${Math.max(...numbers).toFixed(1)} at most`);
}
const connected = (chip.sio.gpioValue >> SWITCH) & 1;
console.log(`${sent} bytes sent, ${resets} resets, the switch is ${connected ? "set" : "at rest"}`);
console.log(`${different} of ${samples.length} codes differ`);
process.exitCode = different || !samples.length ? 1 : 0;
