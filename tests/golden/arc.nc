(half a circle by its centre, a quarter by its radius)
$100=80
$101=80
$102=400
$110=6000
$111=6000
$112=3000
$120=500
$121=500
$122=500
G2 X2 I1 F600
G3 X3 Y1 R1
