(a right angle and a shallow one, without a stop)
$100=80
$101=80
$102=400
$110=6000
$111=6000
$112=3000
$120=500
$121=500
$122=500
G1 X2 F1200
Y1
X1 Y2.2
