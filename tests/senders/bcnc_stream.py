#!/usr/bin/env python3
"""bcnc_stream.py PTY FILE [--level] [--change]  - PyPI bCNC 0.9.16, the program itself: its window on a screen that nobody sees,
steered over the web page that it has for pendants.
--level: probes the plate first, so that bCNC bends the job after it; --change: presses resume at each tool change.
exit 0 job finished; 2 no connection; 4 it does not begin; 6 timeout"""
import json, os, subprocess, sys, tempfile, time, urllib.parse, urllib.request

pty, job = sys.argv[1:3]
options = sys.argv[3:]
PORT, SCREEN = 8899, ':97'
# Each tool change goes to the machine as it stands in the file (policy 0). A grid of 4 x 3 points
# is probed.
SETTINGS = f"""[bCNC]
lastcheck = {int(time.time())}
[Connection]
controller = GRBL1
port = {pty}
openserial = 1
pendant = 1
pendantport = {PORT}
[Probe]
toolpolicy = 0
cmd = G38.2
feed = 300
xmin = 0
xmax = 30
xn = 4
ymin = 0
ymax = 20
yn = 3
zmin = -5
zmax = 1
"""

def ask(page, **words):
    query = urllib.parse.urlencode(words, quote_via=urllib.parse.quote)
    with urllib.request.urlopen(f'http://localhost:{PORT}/{page}?{query}', timeout=5) as answer:
        return answer.read()

def now():
    try: return json.loads(ask('state'))
    except OSError: return {'state': 'not there', 'msg': ''}

def wait(condition, seconds):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition(now()): return True
        time.sleep(0.05)
    return False

def is_over(seen):
    if '--change' in options and seen['state'].startswith('Hold'):
        ask('send', cmd='RESUME')
        time.sleep(0.5)
    return seen['state'] == 'Idle' and 'Completed: 100%' in seen['msg']

with tempfile.TemporaryDirectory() as home:
    with open(f'{home}/.bCNC', 'w') as file: file.write(SETTINGS)
    screen = subprocess.Popen(['Xvfb', SCREEN, '-screen', '0', '1200x900x24'], stderr=subprocess.DEVNULL)
    environment = dict(os.environ, HOME=home, DISPLAY=SCREEN)
    time.sleep(1)
    sender = subprocess.Popen([sys.executable, '-m', 'bCNC', os.path.abspath(job)], env=environment)

    def out(code, why):
        print('exit', code, why, now(), flush=True)
        for process in (sender, screen): process.kill(); process.wait()
        sys.exit(code)

    def perform(command):
        ask('send', cmd=command)
        if not wait(lambda seen: seen['state'] != 'Idle', 15): out(4, command)
        if not wait(is_over, 90): out(6, command)
        time.sleep(4)  # it holds and resets the machine after each run

    if not wait(lambda seen: seen['state'] == 'Idle', 40): out(2, '')
    if '--level' in options: perform('%app.event_generate("<<AutolevelScan>>")')
    perform('RUN')
    out(0, 'done')
