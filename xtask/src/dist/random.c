/* bcryptprimitives.dll for an emulated Windows that has none: random numbers from where it has them. For tests alone. */
#include <windows.h>
#include <ntsecapi.h>

__declspec(dllexport) BOOL WINAPI ProcessPrng(PBYTE to, SIZE_T size)
{
    return RtlGenRandom(to, (ULONG)size);
}
