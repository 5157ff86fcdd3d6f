/* What the C runtime of the compiler would give a Windows DLL, where it is linked without one:
 * everything else comes from ucrtbase.dll. */
int vsnprintf(char *text, size_t size, const char *format, va_list arguments) {
    return __stdio_common_vsprintf(2, text, size, format, NULL, arguments); /* 2: as C99 has it */
}

int DllMainCRTStartup(void *module, unsigned long reason, void *reserved) {
    (void)module, (void)reason, (void)reserved;
    return 1;
}
