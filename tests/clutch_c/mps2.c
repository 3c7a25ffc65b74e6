/* The code before main on the emulated Cortex-M4F: the vectors, and the floating-point unit.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */
#include <stdint.h>

extern void _start(void); /* newlib's */
void reset(void);

__attribute__((section(".vectors"), used)) static void (*const vectors[2])(void) = {
    (void (*)(void))0x20400000u, /* the end of the memory, where the stack begins */
    reset,
};

void reset(void)
{
    *(volatile uint32_t *)0xe000ed88u |= 0xfu << 20;
    __asm volatile("dsb\nisb");
    _start();
}
