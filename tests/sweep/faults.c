/* Preloaded into a process: counts the calls that reach a folder, and kills or fails the n-th of them.

FAULTS_TABLE names a file of a struct Table, which all processes share; FAULTS_FOLDER the folder, by its real path.
What is called is told in FAULTS_LOG, a line a call, if that is set. Linux, glibc.
*/
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

struct Table {
    atomic_int calls;  /* so far */
    atomic_int at;     /* the call that is met, from 1 on; 0: none */
    atomic_int met;    /* has it been met? */
    int error;         /* that it fails with; 0: `killed` is killed */
    int ever;          /* do all later ones fail too? */
    int killed;
};

static struct Table *table;
static const char *folder;
static int told = -1;

__attribute__((constructor)) static void begin(void)
{
    const char *path = getenv("FAULTS_TABLE"), *log = getenv("FAULTS_LOG");
    int (*real)(const char *, int, ...) = dlsym(RTLD_NEXT, "open");
    folder = getenv("FAULTS_FOLDER");
    int file = path && folder ? real(path, O_RDWR | O_CLOEXEC) : -1;
    if (file < 0)
        return;
    table = mmap(NULL, sizeof *table, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (table == MAP_FAILED)
        table = NULL;
    if (log)
        told = real(log, O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0600);
}

/* Is the path in the folder, or the folder itself? */
static int inside(const char *path)
{
    size_t size = strlen(folder);
    return strncmp(path, folder, size) == 0 && (path[size] == '/' || path[size] == 0);
}

static int named(int file, char *path)
{
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    ssize_t size = readlink(link, path, PATH_MAX);
    if (size < 0 || size == PATH_MAX)
        return 0;
    path[size] = 0;
    return 1;
}

/* Count a call that reaches the path; nonzero: it fails, errno is set. */
static int met_path(const char *call, const char *path)
{
    if (!inside(path))
        return 0;
    int number = ++table->calls;
    if (told >= 0)
        dprintf(told, "%d %s %s\n", number, call, path + strlen(folder));
    if (!table->at || number < table->at || (number > table->at && !table->ever))
        return 0;
    table->met = 1;
    if (!table->error) {
        kill(table->killed, SIGKILL);
        if (table->killed != getpid())
            usleep(200000);  /* a worker: its parent is gone before it goes on */
        return 0;
    }
    errno = table->error;
    return 1;
}

static int met_at(const char *call, int at, const char *name)
{
    char path[2 * PATH_MAX + 2];
    if (!table || !name)
        return 0;
    if (name[0] == '/')
        return met_path(call, name);
    if (at == AT_FDCWD ? !getcwd(path, PATH_MAX) : !named(at, path))
        return 0;
    strcat(path, "/");
    strncat(path, name, PATH_MAX);
    return met_path(call, path);
}

static int met_file(const char *call, int file)
{
    char path[PATH_MAX + 1];
    if (!table || !named(file, path))
        return 0;
    return met_path(call, path);
}

#define REAL(type, name, ...)                                                                                        \
    static type (*real)(__VA_ARGS__);                                                                                \
    if (!real)                                                                                                       \
        real = dlsym(RTLD_NEXT, name)

#define ON_FILE(type, name, parameters, given)                                                                       \
    type name parameters                                                                                             \
    {                                                                                                                \
        static type(*real) parameters;                                                                               \
        if (!real)                                                                                                   \
            real = dlsym(RTLD_NEXT, #name);                                                                          \
        return met_file(#name, file) ? -1 : real given;                                                              \
    }
ON_FILE(ssize_t, write, (int file, const void *room, size_t size), (file, room, size))
ON_FILE(ssize_t, pwrite, (int file, const void *room, size_t size, off_t at), (file, room, size, at))
ON_FILE(ssize_t, pwrite64, (int file, const void *room, size_t size, off64_t at), (file, room, size, at))
ON_FILE(ssize_t, writev, (int file, const struct iovec *room, int count), (file, room, count))
ON_FILE(ssize_t, pwritev, (int file, const struct iovec *room, int count, off_t at), (file, room, count, at))
ON_FILE(ssize_t, pwritev64, (int file, const struct iovec *room, int count, off64_t at), (file, room, count, at))
ON_FILE(int, fsync, (int file), (file))
ON_FILE(int, fdatasync, (int file), (file))
ON_FILE(int, ftruncate, (int file, off_t size), (file, size))
ON_FILE(int, ftruncate64, (int file, off64_t size), (file, size))

#define ON_PATH(name, parameters, given)                                                                             \
    int name parameters                                                                                              \
    {                                                                                                                \
        static int(*real) parameters;                                                                                \
        if (!real)                                                                                                   \
            real = dlsym(RTLD_NEXT, #name);                                                                          \
        return met_at(#name, AT_FDCWD, path) ? -1 : real given;                                                      \
    }
ON_PATH(unlink, (const char *path), (path))
ON_PATH(rmdir, (const char *path), (path))
ON_PATH(mkdir, (const char *path, mode_t mode), (path, mode))
ON_PATH(rename, (const char *path, const char *to), (path, to))
ON_PATH(truncate, (const char *path, off_t size), (path, size))
ON_PATH(truncate64, (const char *path, off64_t size), (path, size))

#define ON_PATH_AT(name, parameters, given)                                                                          \
    int name parameters                                                                                              \
    {                                                                                                                \
        static int(*real) parameters;                                                                                \
        if (!real)                                                                                                   \
            real = dlsym(RTLD_NEXT, #name);                                                                          \
        return met_at(#name, at, path) ? -1 : real given;                                                            \
    }
ON_PATH_AT(unlinkat, (int at, const char *path, int flags), (at, path, flags))
ON_PATH_AT(mkdirat, (int at, const char *path, mode_t mode), (at, path, mode))
ON_PATH_AT(renameat, (int at, const char *path, int to_at, const char *to), (at, path, to_at, to))
ON_PATH_AT(renameat2, (int at, const char *path, int to_at, const char *to, unsigned flags),
           (at, path, to_at, to, flags))

/* Opening for reading is told apart. */
#define OPENS(flags) ((flags) & (O_WRONLY | O_RDWR) ? "open" : "read")
#define MODE(flags)                                                                                                  \
    mode_t mode = 0;                                                                                                 \
    if ((flags) & (O_CREAT | __O_TMPFILE)) {                                                                         \
        va_list list;                                                                                                \
        va_start(list, flags);                                                                                       \
        mode = va_arg(list, mode_t);                                                                                 \
        va_end(list);                                                                                                \
    }
#define OPEN(name)                                                                                                   \
    int name(const char *path, int flags, ...)                                                                       \
    {                                                                                                                \
        REAL(int, #name, const char *, int, ...);                                                                    \
        MODE(flags)                                                                                                  \
        return met_at(OPENS(flags), AT_FDCWD, path) ? -1 : real(path, flags, mode);                                  \
    }
OPEN(open)
OPEN(open64)
#define OPEN_AT(name)                                                                                                \
    int name(int at, const char *path, int flags, ...)                                                               \
    {                                                                                                                \
        REAL(int, #name, int, const char *, int, ...);                                                               \
        MODE(flags)                                                                                                  \
        return met_at(OPENS(flags), at, path) ? -1 : real(at, path, flags, mode);                                    \
    }
OPEN_AT(openat)
OPEN_AT(openat64)

#define FOPEN(name)                                                                                                  \
    FILE *name(const char *path, const char *how)                                                                    \
    {                                                                                                                \
        REAL(FILE *, #name, const char *, const char *);                                                             \
        return met_at(how[0] == 'r' && !strchr(how, '+') ? "read" : "open", AT_FDCWD, path) ? NULL : real(path, how); \
    }
FOPEN(fopen)
FOPEN(fopen64)

DIR *opendir(const char *path)
{
    REAL(DIR *, "opendir", const char *);
    return met_at("read", AT_FDCWD, path) ? NULL : real(path);
}
