/* The part of Arduino's core that the sketch takes, declared: to compile it where no core is. */
#ifndef ARDUINO_H
#define ARDUINO_H
#include <stdint.h>
#include <stddef.h>
enum { LOW, HIGH, INPUT_PULLUP, CHANGE, A0 };
struct Printer {
    void begin(unsigned long);
    void print(const char *);
    void println(unsigned);
};
extern Printer Serial;
void pinMode(int, int);
int digitalRead(int);
int digitalPinToInterrupt(int);
void attachInterrupt(int, void (*)(), int);
void analogWriteResolution(int);
void analogWrite(int, int);
unsigned long micros();
void delay(unsigned long);
void noInterrupts();
void interrupts();
#endif
