# What psych, vcd and lme4 make of a table: Rscript peers.R FILE KIND CATEGORY,...
# FILE has the names of items and a column a rater, of numbers; KIND is grades or
# measurements. A line is a program, a coefficient, weights, a quantity and its value.
arguments <- commandArgs(trailingOnly = TRUE)
ratings <- read.csv(arguments[1], row.names = 1)
categories <- as.numeric(strsplit(arguments[3], ",")[[1]])

report <- function(program, coefficient, weights, quantity, value)
  cat(program, coefficient, weights, quantity, format(value, digits = 17), "\n", sep = "\t")
version <- function(name)
  cat("version", name, as.character(packageVersion(name)), "\n", sep = "\t")
try_all <- function(program, coefficient, weights, work) {
  values <- tryCatch(suppressMessages(suppressWarnings(work())),
                     error = function(e) list(value = "error"))
  for (quantity in names(values))
    report(program, coefficient, weights, quantity, values[[quantity]])
}

if (arguments[2] == "grades" && requireNamespace("psych", quietly = TRUE)) {
  version("psych")
  grades <- as.data.frame(lapply(ratings, factor, levels = categories))
  if (ncol(grades) == 2) {
    of_two <- function(row, ...) function() {
      found <- psych::cohen.kappa(table(grades), ...)$confid[row, ]
      list(value = found[2], low = found[1], high = found[3])
    }
    try_all("psych", "cohen_kappa", "identity", of_two(1))
    if ("w.exp" %in% names(formals(psych::cohen.kappa)))
      try_all("psych", "cohen_kappa", "linear", of_two(2, w.exp = 1))
    try_all("psych", "cohen_kappa", "quadratic", of_two(2))
  } else {
    try_all("psych", "light_kappa", "identity", function()
      list(value = psych::cohen.kappa(ratings)$av.kappa))
  }
}
if (arguments[2] == "grades" && ncol(ratings) == 2 &&
    requireNamespace("vcd", quietly = TRUE)) {
  version("vcd")
  counts <- table(lapply(ratings, factor, levels = categories))
  of_two <- function(kind, spacing) function() {
    kappa <- vcd::Kappa(counts, weights = spacing)
    ends <- confint(kappa)[kind, ]
    list(value = kappa[[kind]][["value"]], error = kappa[[kind]][["ASE"]],
         low = ends[[1]], high = ends[[2]])
  }
  try_all("vcd", "cohen_kappa", "identity", of_two("Unweighted", "Equal-Spacing"))
  try_all("vcd", "cohen_kappa", "linear", of_two("Weighted", "Equal-Spacing"))
  try_all("vcd", "cohen_kappa", "quadratic", of_two("Weighted", "Fleiss-Cohen"))
}
if (arguments[2] == "measurements" && requireNamespace("psych", quietly = TRUE)) {
  version("psych")
  forms <- c("icc_1", "icc_a1", "icc_c1", "icc_1k", "icc_ak", "icc_ck")
  for (by in c("psych lmer=FALSE", "psych")) for (row in seq_along(forms))
    try_all(by, forms[row], "identity", function() {
      found <- psych::ICC(ratings, lmer = by == "psych")$results[row, ]
      list(value = found$ICC, low = found[["lower bound"]], high = found[["upper bound"]])
    })
}
if (arguments[2] == "measurements" && requireNamespace("lme4", quietly = TRUE)) {
  version("lme4")
  long <- data.frame(y = unlist(ratings), item = rep(rownames(ratings), ncol(ratings)),
                     rater = rep(names(ratings), each = nrow(ratings)))
  parts <- function(formula) {
    fit <- lme4::lmer(formula, long, na.action = na.omit,
                      control = lme4::lmerControl(optCtrl = list(xtol_abs = 1e-12,
                                                                 ftol_abs = 1e-14)))
    found <- as.data.frame(lme4::VarCorr(fit))
    setNames(found$vcov, found$grp)
  }
  k <- ncol(ratings)
  try_all("lme4", "icc_1", "identity", function() {
    v <- parts(y ~ 1 + (1 | item))
    list(value = v[["item"]] / sum(v))
  })
  of <- function(noise) function() {
    v <- parts(y ~ 1 + (1 | item) + (1 | rater))
    list(value = v[["item"]] / (v[["item"]] + noise(v)))
  }
  try_all("lme4", "icc_a1", "identity", of(function(v) v[["rater"]] + v[["Residual"]]))
  try_all("lme4", "icc_c1", "identity", of(function(v) v[["Residual"]]))
  try_all("lme4", "icc_ak", "identity", of(function(v) (v[["rater"]] + v[["Residual"]]) / k))
  try_all("lme4", "icc_ck", "identity", of(function(v) v[["Residual"]] / k))
}
