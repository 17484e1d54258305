(Block-name: Header)
(Block-expand: 0)
(Block-enable: 1)
M3 S12000
G4 P3
G0 Z10
(Block-name: 0 [cut:-2])
(Block-expand: 0)
(Block-enable: 1)
(Block-color: #000000)
(pass -1.000000)
g0 z3
g0 x0 y0
g1 z-1 f200
(entered)
g1 x0 y40 z-1 f600
g1 x60 y40 z-1
g1 x60 y0 z-1
g1 x0 y0 z-1
(pass -2.000000)
g0 x0 y0
g1 z-2 f200
(entered)
g1 x0 y40 z-2 f600
g1 x60 y40 z-2
g1 x60 y0 z-2
g1 x0 y0 z-2
(exiting)
g0 z3
(Block-name: 0 [out,conventional,ccw,cut:-2])
(Block-expand: 0)
(Block-enable: 1)
(pass -1.000000)
g0 z3
g0 x-1.5 y0
g1 z-1 f200
(entered)
g3 x0 y-1.5 i1.5 j0 z-1  f600
g1 x60 y-1.5 z-1
g3 x61.5 y0 i0 j1.5 z-1 
g1 x61.5 y40 z-1
g3 x60 y41.5 i-1.5 j0 z-1 
g1 x0 y41.5 z-1
g3 x-1.5 y40 i0 j-1.5 z-1 
g1 x-1.5 y0 z-1
(pass -2.000000)
g0 x-1.5 y0
g1 z-2 f200
(entered)
g3 x0 y-1.5 i1.5 j0 z-2  f600
g1 x60 y-1.5 z-2
g3 x61.5 y0 i0 j1.5 z-2 
g1 x61.5 y40 z-2
g3 x60 y41.5 i-1.5 j0 z-2 
g1 x0 y41.5 z-2
g3 x-1.5 y40 i0 j-1.5 z-2 
g1 x-1.5 y0 z-2
(exiting)
g0 z3
(Block-name: 0 [cut:-2])
(Block-expand: 0)
(Block-enable: 1)
(Block-color: #000000)
(pass -1.000000)
g0 z3
g0 x50 y20
g1 z-1 f200
(entered)
g1 x30 y20 z-1 f600
g2 x50 y20 i10 j0 z-1 
(pass -2.000000)
g0 x50 y20
g1 z-2 f200
(entered)
g1 x30 y20 z-2 f600
g2 x50 y20 i10 j0 z-2 
(exiting)
g0 z3
(Block-name: 0 [out,conventional,ccw,cut:-2])
(Block-expand: 0)
(Block-enable: 1)
(pass -1.000000)
g0 z3
g0 x50 y18.5
g1 z-1 f200
(entered)
g3 x51.5 y20 i0 j1.5 z-1  f600
g3 x28.5 y20 i-11.5 j0 z-1 
g3 x30 y18.5 i1.5 j0 z-1 
g1 x50 y18.5 z-1
(pass -2.000000)
g0 x50 y18.5
g1 z-2 f200
(entered)
g3 x51.5 y20 i0 j1.5 z-2  f600
g3 x28.5 y20 i-11.5 j0 z-2 
g3 x30 y18.5 i1.5 j0 z-2 
g1 x50 y18.5 z-2
(exiting)
g0 z3
(Block-name: 0 [cut:-2])
(Block-expand: 0)
(Block-enable: 1)
(Block-color: #000000)
(pass -1.000000)
g0 z3
g0 x23 y20
g1 z-1 f200
(entered)
g2 x23 y20 i-8 j0 z-1  f600
(pass -2.000000)
g0 x23 y20
g1 z-2 f200
(entered)
g2 x23 y20 i-8 j0 z-2  f600
(exiting)
g0 z3
(Block-name: 0 [out,conventional,ccw,cut:-2])
(Block-expand: 0)
(Block-enable: 1)
(pass -1.000000)
g0 z3
g0 x24.5 y20
g1 z-1 f200
(entered)
g3 x24.5 y20 i-9.5 j0 z-1  f600
(pass -2.000000)
g0 x24.5 y20
g1 z-2 f200
(entered)
g3 x24.5 y20 i-9.5 j0 z-2  f600
(exiting)
g0 z3
(Block-name: Footer)
(Block-expand: 0)
(Block-enable: 1)
G0 Z10
M5
