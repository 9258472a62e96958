"""NURBS curves: immutable splines of any number of axes, and all of many curves at once as arrays; no paths.

In come knots, control points and weights; out come points, derivatives, arc length and its inverse, nearest points.
`curve` is NurbsCurve, `spline` what it is made of, `packed` many in a row, `flat` all of them as arrays; `arcs` makes
and `editing` changes curves; `tables` makes the table of pieces of many curves by arc length in the metric of
`metric`, `pieces` reads it; `differential` has curvature and angles; `nearest` and `search` find nearest points.
"""
