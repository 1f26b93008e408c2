"""The Dirichlet-multinomial posterior of agreement by any raters, exactly."""
