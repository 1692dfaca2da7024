# Registers of the STM32F205 and its Cortex-M3, and the semihosting call. Nothing here allocates.
#
# Addresses are written as their quarter, << 2: viper takes no constant above 2**30.

# ruff: noqa: F821  (ptr8, ptr32 are viper's; push, data, wfi the assembler's)

import micropython
from micropython import const

_USART1 = const(0x10004400)         # 0x40011000: SR +0, DR +1, BRR +2, CR1 +3 (words)
_USART2 = const(0x10001100)         # 0x40004400
_SYSTICK = const(0x38003804)        # 0xE000E010: CTRL +0, LOAD +1, VAL +2
_ICSR = const(0x38003B41)           # 0xE000ED04
_NVIC_ENABLE_1 = const(0x38003841)  # 0xE000E104: interrupts 32 to 63
_NVIC_CLEAR_1 = const(0x380038A1)   # 0xE000E284
_USART2_BIT = const(1 << 6)         # interrupt 38
_RXNE = const(1 << 5)
_TXE = const(1 << 7)
_UE_TE_RE_RXNEIE = const(1 << 13 | 1 << 3 | 1 << 2 | 1 << 5)
_PENDING = const(1 << 26)           # PENDSTSET; the bit below it clears
_RELOAD = const(11999999)           # 100 ms at 120 MHz: longer than any tick may take


# The operation, then the three words of its block (a buffer is passed as its address) -> the call's result.
@micropython.asm_thumb
def semihost(r0, r1, r2, r3):
    push({r1, r2, r3})
    data(2, 0x4669)     # mov r1, sp
    data(2, 0xBEAB)     # bkpt 0xAB
    pop({r1, r2, r3})


@micropython.asm_thumb
def _mask_interrupts():
    data(2, 0xB672)     # cpsid i


@micropython.asm_thumb
def _wait_for_interrupt():
    wfi()               # a pending one ends it, masked or not


@micropython.viper
def clock_start():
    _mask_interrupts()
    tick = ptr32(_SYSTICK << 2)
    tick[1] = _RELOAD
    tick[2] = 0
    tick[0] = 7         # the processor's clock, its wrap made pending


@micropython.viper
def clock_stop():
    tick = ptr32(_SYSTICK << 2)
    tick[0] = 0
    icsr = ptr32(_ICSR << 2)
    icsr[0] = _PENDING >> 1


@micropython.viper
def clock_value() -> int:
    tick = ptr32(_SYSTICK << 2)
    return tick[2]


# 1 once after each wrap of the clock.
@micropython.viper
def clock_wrapped() -> int:
    icsr = ptr32(_ICSR << 2)
    if icsr[0] & _PENDING:
        icsr[0] = _PENDING >> 1
        return 1
    return 0


@micropython.viper
def usart_open():
    usart = ptr32(_USART2 << 2)
    usart[3] = _UE_TE_RE_RXNEIE
    enable = ptr32(_NVIC_ENABLE_1 << 2)
    enable[0] = _USART2_BIT


# Bytes until a frame ends (`end` behind something else), the buffer is full, or the clock has wrapped. `last` is the byte
# received before: a frame whose end comes after a wrap ends as every other, and is not waited upon for one more.
# The receive register holds one byte: the flag is looked at before sleeping, and a byte that comes
# between the two is pending already, so that none is slept over.
@micropython.viper
def usart_receive(buf, size: int, last: int, end: int) -> int:
    into = ptr8(buf)
    usart = ptr32(_USART2 << 2)
    clear = ptr32(_NVIC_CLEAR_1 << 2)
    icsr = ptr32(_ICSR << 2)
    n = 0
    while n < size:
        clear[0] = _USART2_BIT
        if usart[0] & _RXNE:
            byte = usart[1] & 255
            into[n] = byte
            n += 1
            if byte == end and last != end:
                return n
            last = byte
        elif icsr[0] & _PENDING:
            return n
        else:
            _wait_for_interrupt()
    return n


@micropython.viper
def usart_send(buf, size: int):
    out = ptr8(buf)
    usart = ptr32(_USART2 << 2)
    i = 0
    while i < size:
        while not usart[0] & _TXE:
            pass
        usart[1] = out[i]
        i += 1


# Whether Ctrl-C has come on the REPL's USART1, which nobody else reads while the core runs.
@micropython.viper
def repl_interrupted() -> int:
    usart = ptr32(_USART1 << 2)
    if usart[0] & _RXNE:
        if usart[1] & 255 == 3:
            return 1
    return 0
