(X0 Y0 Z0: the start point of the part. Heat nozzle and bed first: Grbl has no words for it.)
G21 G90 G94 G17
M5
M3 S1000
G1 X50 Y0 F1005
G1 Z0.5 F192
G1 X0 Y0 F1005
G1 Z1 F192
G1 X50 Y0 F1005
G1 Z1.5 F192
G1 X0 Y0 F1005
G1 Z2 F192
G1 X50 Y0 F1005
M5
M30
