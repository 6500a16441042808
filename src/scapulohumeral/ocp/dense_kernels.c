/* Dense kernels that MUMPS calls, on the BLAS of scipy's wheel.
 *
 * The BLAS of the casadi wheel is built for processors of 2006, and its dgemmt, which updates one
 * triangle of a symmetric block, goes column by column. Here it goes in blocks of columns. */

typedef const int *ints;
typedef const double *reals;

void scipy_dgemm_(const char *, const char *, ints, ints, ints, reals, reals, ints, reals, ints,
                  reals, double *, ints);
void scipy_dtrsm_(const char *, const char *, const char *, const char *, ints, ints, reals, reals,
                  ints, double *, ints);

enum { WIDTH = 32 };

static int is(const char *given, char letter) { return (*given | 32) == letter; }

void dgemm_(const char *ta, const char *tb, ints m, ints n, ints k, reals alpha, reals a, ints la,
            reals b, ints lb, reals beta, double *c, ints lc)
{
    scipy_dgemm_(ta, tb, m, n, k, alpha, a, la, b, lb, beta, c, lc);
}

void dtrsm_(const char *side, const char *uplo, const char *ta, const char *diag, ints m, ints n,
            reals alpha, reals a, ints la, double *b, ints lb)
{
    scipy_dtrsm_(side, uplo, ta, diag, m, n, alpha, a, la, b, lb);
}

/* c = beta c + block in the chosen triangle of a square block. */
static void add_triangle(int upper, int size, double beta, const double *block, double *c, long lc)
{
    for (int column = 0; column < size; column++) {
        int first = upper ? 0 : column, end = upper ? column + 1 : size;
        for (int row = first; row < end; row++) {
            double before = beta == 0.0 ? 0.0 : beta * c[column * lc + row];
            c[column * lc + row] = before + block[column * WIDTH + row];
        }
    }
}

void dgemmt_(const char *uplo, const char *ta, const char *tb, ints n, ints k, reals alpha, reals a,
             ints la, reals b, ints lb, reals beta, double *c, ints lc)
{
    const double none = 0.0;
    const int width = WIDTH, upper = is(uplo, 'u');
    /* From one row of a, and one column of b, to the next. */
    const long row = is(ta, 'n') ? 1 : *la, column = is(tb, 'n') ? *lb : 1;
    double block[WIDTH * WIDTH];
    for (int start = 0; start < *n; start += WIDTH) {
        int size = *n - start < WIDTH ? *n - start : WIDTH;
        int first = upper ? 0 : start + size, rows = upper ? start : *n - first;
        reals right = b + start * column;
        double *target = c + (long)start * *lc;
        scipy_dgemm_(ta, tb, &size, &size, k, alpha, a + start * row, la, right, lb, &none, block,
                     &width);
        add_triangle(upper, size, *beta, block, target + start, *lc);
        if (rows > 0)
            scipy_dgemm_(ta, tb, &rows, &size, k, alpha, a + first * row, la, right, lb, beta,
                         target + first, lc);
    }
}
