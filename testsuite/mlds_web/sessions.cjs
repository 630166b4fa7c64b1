'use strict';
// Whole sessions in headless Chromium: two participants at once, each with 210 trials, a reload in
// the middle, the server killed (SIGKILL) and started anew, and the files compared with every click.
const assert = require('node:assert');
const { spawn, execFileSync } = require('node:child_process');
const fs = require('node:fs');
const path = require('node:path');
const { chromium } = require('playwright-core');

const [program, work, browserPath, screenshots] = process.argv.slice(2);
const study = path.join(work, 'study');
const TRIALS = 210, PRACTICE = 2, CATCH = 3;
const CARD_PX = 300;  // where the slider of the calibration is left

/** Starts the server and resolves with its address. */
function serve(port = 0) {
  return new Promise((resolve, reject) => {
    const server = spawn(program, ['mlds', 'serve', path.join(work, 'stimuli', 'stimuli.json'),
      '--out', study, '--practice', String(PRACTICE), '--catch', String(CATCH), '--seed', '7', '--port', String(port)]);
    server.stderr.pipe(process.stderr);
    server.stdout.on('data', (bytes) => {
      const url = String(bytes).trim();
      if (url.startsWith('http://127.0.0.1:')) resolve({ server, url });
    });
    server.on('exit', (code) => reject(new Error(`server ended with ${code}`)));
  });
}

const portOf = (url) => Number(new URL(url).port);

async function picture(page, name) {
  if (!screenshots) return;
  fs.mkdirSync(screenshots, { recursive: true });
  await page.screenshot({ path: path.join(screenshots, `${name}.png`) });
}

async function begin(page, url, code, isPhotographed) {
  await page.goto(url);
  await page.fill('#code', code);
  if (isPhotographed) await picture(page, 'code');
  await page.click('#next');
  await page.check('#consent');
  if (isPhotographed) await picture(page, 'consent');
  await page.click('#next');
  await page.waitForFunction(() => document.querySelector('h1')?.textContent === 'What to do');
  if (isPhotographed) await picture(page, 'instructions');
  await page.click('#next');
  await page.waitForSelector('#size');
  await page.fill('#size', String(CARD_PX));
  await page.fill('#distance', '60');
  if (isPhotographed) await picture(page, 'calibration');
  await page.click('#next');
  await page.waitForFunction(() => document.querySelector('h1')?.textContent === 'Ready');
  if (isPhotographed) await picture(page, 'ready');
  await page.click('#next');
}

/** Answers questions until `until` of them are answered; notes what was chosen. */
async function work_through(person, until, isPhotographed) {
  const { page, chosen, mouse: useMouse } = person;
  for (;;) {
    await page.waitForFunction(() => document.getElementById('screen').dataset.finished
      || (document.getElementById('next') && document.querySelector('h1')?.textContent !== 'Ready')
      || (document.getElementById('top')
        && document.getElementById('screen').dataset.ready
          === document.getElementById('screen').dataset.trial), null, { polling: 20 });
    if (await page.evaluate(() => document.getElementById('screen').dataset.finished)) return true;
    if (await page.$('#next')) {
      if (await page.textContent('h1') === 'A break') {
        person.breaks.push(chosen.length);
        if (isPhotographed) await picture(page, 'break');
      }
      await page.click('#next');
      continue;
    }
    const trial = Number(await page.evaluate(() =>
      document.getElementById('screen').dataset.trial));
    if (trial >= until) return false;
    assert.strictEqual(trial, chosen.length, 'questions come one after the other');
    const says = await page.textContent('.question');
    assert.strictEqual(/^For practice/.test(says), trial < PRACTICE, says);
    const top = (trial * 7 + (useMouse ? 1 : 0)) % 3 !== 0;
    await page.waitForTimeout(205);  // earlier answers are taken for a key still held
    if (isPhotographed && trial === 5) await picture(page, 'trial');
    if (useMouse) await page.click(top ? '#top' : '#bottom');
    else await page.keyboard.press(top ? 'ArrowUp' : 'ArrowDown');
    chosen.push(top ? 'top' : 'bottom');
    await page.waitForFunction((t) => document.getElementById('screen').dataset.ready !== String(t)
      || !document.getElementById('top'), trial, { polling: 20 });
  }
}

function check_files(code, chosen) {
  const folder = path.join(study, 'participants', code);
  const rows = fs.readFileSync(path.join(folder, 'log.csv'), 'utf8').trim().split('\n');
  const names = rows[0].split(',');
  const log = rows.slice(1).map((row) =>
    Object.fromEntries(row.split(',').map((value, i) => [names[i], value])));
  assert.strictEqual(log.length, chosen.length);
  log.forEach((row, i) => {
    assert.strictEqual(row.choice, chosen[i], `answer ${i + 1} of ${code}`);
    assert.strictEqual(Number(row.trial), i + 1);
    assert.ok(Number(row.reaction_ms) >= 200);
    const top = [row.top_left, row.top_right].map(Number).sort((a, b) => a - b);
    const first = [row.S1, row.S2].map(Number);
    const isFirstOnTop = top[0] === first[0] && top[1] === first[1];
    assert.strictEqual(Number(row.resp), (row.choice === 'top') === isFirstOnTop ? 0 : 1);
  });
  const count = (kind) => log.filter((row) => row.kind === kind).length;
  assert.strictEqual(count('practice'), PRACTICE);
  assert.strictEqual(count('catch'), CATCH);
  // 8 degrees at 60 cm are 83.9 mm, for which the test's window has room.
  const session = JSON.parse(fs.readFileSync(path.join(folder, 'session.json'), 'utf8'));
  assert.ok(Math.abs(session.calibration.px_per_mm - CARD_PX / 85.6) < 1e-9);
  assert.strictEqual(session.calibration.distance_mm, 600);
  assert.strictEqual(session.has_consented, true);
  const wished = 2 * 600 * Math.tan(4 * Math.PI / 180) * CARD_PX / 85.6;
  log.forEach((row) => assert.ok(Math.abs(row.stimulus_size_px - wished) < 0.1, row.stimulus_size_px));
  const main = log.filter((row) => row.kind === 'main');
  assert.strictEqual(main.length, TRIALS);
  assert.strictEqual(new Set(main.map((r) => [r.S1, r.S2, r.S3, r.S4].join())).size, TRIALS);
  const trials = fs.readFileSync(path.join(folder, 'trials.csv'), 'utf8').trim().split('\n');
  assert.strictEqual(trials[0], 'resp,S1,S2,S3,S4');
  assert.deepStrictEqual(trials.slice(1),
    main.map((r) => [r.resp, r.S1, r.S2, r.S3, r.S4].join()));
}

async function main() {
  let { server, url } = await serve();
  server.removeAllListeners('exit');
  const browser = await chromium.launch({ executablePath: browserPath,
    args: ['--no-sandbox', '--disable-gpu'] });
  const errors = [];
  const open = async () => {
    const context = await browser.newContext({ viewport: { width: 1280, height: 900 } });
    const page = await context.newPage();
    page.on('pageerror', (error) => errors.push(String(error)));
    page.on('console', (message) => {
      if (/Content Security Policy/.test(message.text())) errors.push(message.text());
    });
    page.on('request', (request) => {
      if (!/^(http:\/\/127\.0\.0\.1:|blob:)/.test(request.url())) errors.push(request.url());
    });
    return page;
  };
  const people = [{ code: 'ann-1', page: await open(), chosen: [], breaks: [], mouse: false },
    { code: 'bob_2', page: await open(), chosen: [], breaks: [], mouse: true }];

  await Promise.all(people.map((p, i) => begin(p.page, url, p.code, i === 0)));
  await Promise.all(people.map((p, i) =>
    work_through(p, 40 + 11 * i, i === 0)));

  // A reload in the middle comes back to the same question.
  await people[0].page.reload();
  await work_through(people[0], 60, true);

  // The server dies without warning, and one page answers while it is away.
  server.kill('SIGKILL');
  const port = portOf(url);
  await people[0].page.waitForTimeout(300);
  await people[0].page.keyboard.press('ArrowUp');
  people[0].chosen.push('top');
  await people[0].page.waitForSelector('#alert:not([hidden])');
  await picture(people[0].page, 'lost');
  ({ server, url } = await serve(port));
  server.removeAllListeners('exit');
  await people[0].page.waitForFunction(() =>
    /new address/.test(document.getElementById('alert').textContent));
  // The new address carries the new token; the answer that was never confirmed is asked again.
  people[0].chosen.pop();
  await Promise.all(people.map((p) => p.page.goto('about:blank').then(() => p.page.goto(url))));
  const finished = await Promise.all(people.map((p) =>
    work_through(p, 1e9, p.mouse)));
  assert.deepStrictEqual(finished, [true, true]);
  await picture(people[0].page, 'thanks');
  for (const p of people) check_files(p.code, p.chosen);
  // A rest after every 70 questions at a stretch; both were greeted anew at 60 and 51.
  assert.deepStrictEqual(people.map((p) => p.breaks), [[130, 200], [121, 191]]);
  assert.deepStrictEqual(errors, []);
  await browser.close();
  server.kill('SIGTERM');

  // What was written can be analysed at once.
  const logs = people.map((p) => path.join(study, 'participants', p.code, 'log.csv'));
  try {
    execFileSync(program, ['mlds', 'fit', ...logs, '--stimuli',
      path.join(work, 'stimuli', 'stimuli.json'), '--bootstrap', '100',
      '--bootstrap-observer', '100', '--out', path.join(work, 'scale.json')]);
  } catch (error) {
    assert.strictEqual(error.status, 4, 'answers that follow no scale are called so');
  }
  assert.strictEqual(JSON.parse(fs.readFileSync(path.join(work, 'scale.json'))).trials,
    2 * TRIALS);
  console.log(`two sessions of ${TRIALS} trials, a reload and a killed server: all answers kept`);
}

main().then(() => process.exit(0), (error) => {
  console.error(error);
  process.exit(1);
});
