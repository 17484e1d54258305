(a raster row with lead-in and lead-out: power follows the speed)
$30=1000
$32=1
$100=80
$101=80
$102=400
$110=6000
$111=6000
$112=3000
$120=500
$121=500
$122=500
M4 S0
G1 X1 F3000
X1.5 S200
X2 S1000
X2.5 S0
X3 S500
X4 S0
M5
