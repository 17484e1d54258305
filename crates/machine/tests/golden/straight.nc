(units, distance modes, feeds)
G21 G90 G94
G0 X10 Y5
G1 Z-0.5 F100
X20 Y-5.125 F1500
; relative moves keep what is below a step
G91
X0.0001
X0.0001
N40 Y-1
G90 G20
G1 X1 F10
G21 X0 (the feed is still 10 inches a minute)
G93 X10 F2
G94 X0
G94 X0 F600
$G
