'use strict';
// One session: code, consent, instructions, calibration, pictures, trials with rests, thanks.
// The server holds all state; a question is shown only after the answer before it is on disk.

const BLANK_MS = 350;        // grey between questions, so that no motion shows what changed
const IGNORE_MS = 200;       // a key still held from the last question is no answer
const CARD_MM = { width: 85.60, height: 53.98 };  // ISO/IEC 7810 ID-1
const screenElement = document.getElementById('screen');
const alertElement = document.getElementById('alert');
const token = location.hash.slice(1);
let study = null;
let state = null;
let pictures = [];

window.addEventListener('hashchange', () => location.reload());

function element(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith('on')) node.addEventListener(key.slice(2), value);
    else if (key in node) node[key] = value;
    else node.setAttribute(key, value);
  }
  node.append(...children);
  return node;
}

function show(...nodes) {
  screenElement.replaceChildren(...nodes);
  const first = screenElement.querySelector('[autofocus]');
  if (first) first.focus();
}

function text(title, ...children) {
  return element('div', { className: 'text' }, element('h1', {}, title), ...children);
}

function paragraph(words, className = '') {
  return element('p', { className }, words);
}

function warn(words) {
  alertElement.hidden = !words;
  alertElement.textContent = words || '';
}

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** Asks the server and does not give up while it is away. Refusals are errors at once. */
async function ask(path, body) {
  const options = { headers: { 'X-Vitrine-Token': token }, cache: 'no-store' };
  if (body) {
    options.method = 'POST';
    options.headers['Content-Type'] = 'application/json';
    options.body = JSON.stringify(body);
  }
  for (;;) {
    let response = null;
    try {
      response = await fetch(path, options);
    } catch {
      warn('The connection to the experiment is lost. Nothing is lost: please wait.');
    }
    if (response && response.ok) {
      warn('');
      return response;
    }
    if (response && response.status === 401) {
      warn('The experiment was started anew. Please ask the experimenter for the new address.');
      await new Promise(() => {});
    }
    if (response && response.status < 500) {
      const reply = await response.json().catch(() => ({ error: response.statusText }));
      throw new Error(reply.error);
    }
    if (response) warn('The answer could not be stored. Please call the experimenter.');
    await sleep(700);
  }
}

const post = async (path, body) =>
  (await ask(path, { participant: state ? state.participant : '', ...body })).json();

function button(words, action) {
  return element('button', { className: 'main', type: 'button', autofocus: true, onclick: action,
    id: 'next' }, words);
}

/** Shows nodes with a button and waits for it. */
function page(title, words, ...nodes) {
  return new Promise((resolve) =>
    show(text(title, ...nodes, element('p', {}, button(words, resolve)))));
}

async function enterCode() {
  const remembered = sessionStorage.getItem('participant');
  if (remembered) {
    try {
      return await (await ask('/api/session', { participant: remembered })).json();
    } catch (error) {
      sessionStorage.removeItem('participant');
    }
  }
  for (;;) {
    const code = await new Promise((resolve) => {
      const field = element('input', { type: 'text', id: 'code', maxLength: 32, autofocus: true,
        autocomplete: 'off', pattern: '[A-Za-z0-9][A-Za-z0-9_\\-]*', required: true });
      const form = element('form', { onsubmit: (event) => {
        event.preventDefault();
        resolve(field.value.trim());
      } }, element('label', {}, 'Your participant code: ', field),
      element('button', { className: 'main', id: 'next' }, 'Begin or continue'));
      show(text(study.title, paragraph('The experimenter gives you the code. Letters and digits '
        + 'only, and no name: it stands in the files of the study.', 'hint'), form));
    });
    try {
      const opened = await (await ask('/api/session', { participant: code })).json();
      sessionStorage.setItem('participant', code);
      warn('');
      return opened;
    } catch (error) {
      warn(error.message);
    }
  }
}

async function consent() {
  await new Promise((resolve) => {
    const next = button('Continue', resolve);
    next.disabled = true;
    const box = element('input', { type: 'checkbox', id: 'consent',
      onchange: () => { next.disabled = !box.checked; } });
    show(text('Taking part',
      paragraph('You will compare pictures of a glass object. It takes about half an hour. '
        + 'There is no risk beyond that of looking at a screen.'),
      paragraph('Stored are your code, which pair you choose, how long you take, and the size of '
        + 'the pictures on your screen. The files stay on this computer. You can stop at any '
        + 'time by closing the page, without giving a reason.'),
      element('label', {}, box, ' I have read this and want to take part.'),
      element('p', {}, next)));
  });
  state = await post('/api/consent', {});
}

const instructions = () => page('What to do', 'I have understood',
  paragraph('Each time you see two pairs of pictures, one above and one below. Look at the light '
    + 'that the glass throws on the table.'),
  paragraph('In which pair do the two pictures differ more? Press the up arrow for the pair above '
    + 'or the down arrow for the pair below, or click on the pair.'),
  paragraph('There is no right or wrong. If both seem alike, choose what seems a little more '
    + 'different. Take your time; you can rest whenever a break is offered.'),
  paragraph('Dim the room so that nothing is mirrored in the screen, and keep your distance from it '
    + 'the same throughout.', 'hint'));

async function calibrate() {
  const known = state.calibration;
  if (known.px_per_mm > 0 && known.device_pixel_ratio === devicePixelRatio) return;
  const result = await new Promise((resolve) => {
    const card = element('div', { className: 'card', id: 'card' });
    const slider = element('input', { type: 'range', id: 'size', min: 120, max: 1100, step: 1,
      value: 324, 'aria-label': 'width of the card' });
    const resize = () => {
      card.style.width = `${slider.value}px`;
      card.style.height = `${slider.value * CARD_MM.height / CARD_MM.width}px`;
    };
    slider.addEventListener('input', resize);
    resize();
    const distance = element('input', { type: 'number', id: 'distance', min: 20, max: 300,
      step: 1, value: Math.round(study.distance_mm / 10) });
    show(text('Size of your screen',
      paragraph('Hold a bank card or any card of that size against the screen and make the grey '
        + 'card as large with the slider (arrow keys move it finely).'), card, slider,
      element('label', {}, 'Distance of your eyes from the screen in cm: ', distance),
      element('p', {}, button('The card fits', () => {
        const cm = Number(distance.value);
        if (cm >= 20 && cm <= 300) {
          resolve({ px_per_mm: Number(slider.value) / CARD_MM.width, distance_mm: 10 * cm,
            device_pixel_ratio: devicePixelRatio });
        }
      }))));
    slider.focus();
  });
  state = await post('/api/calibration', result);
}

async function loadPictures() {
  show(text('One moment', paragraph('The pictures are being loaded.')));
  pictures = [];
  for (let rank = 1; rank <= study.stimulus_count; ++rank) {
    const blob = await (await ask(`/api/stimulus/${rank}`)).blob();
    const url = URL.createObjectURL(blob);
    const image = new Image();
    image.src = url;
    await image.decode();
    pictures[rank] = { url, image };  // the decoded image is kept, so that it shows at once
  }
}

/** Side of a picture in CSS pixels for the wished visual angle. */
function wishedSize() {
  const { px_per_mm: scale, distance_mm: distance } = state.calibration;
  return 2 * distance * Math.tan(study.picture_deg * Math.PI / 360) * scale;
}

/** What the window has room for of it. */
function pictureSize() {
  const room = Math.min((innerHeight - 150) / 2, (innerWidth - 80) / 2);
  return Math.max(64, Math.min(wishedSize(), room));
}

/** A button for the whole screen and, while the window is too small, words that say so. */
function windowAdvice() {
  const words = paragraph('', 'hint');
  const look = () => {
    const share = pictureSize() / wishedSize();
    words.textContent = share > 0.99 ? 'The window is large enough.'
      : `The window is too small: the pictures would be shown at ${Math.round(100 * share)} % of `
        + 'their size. Please make it larger.';
  };
  addEventListener('resize', look);
  look();
  return [words, element('button', { className: 'main', type: 'button', id: 'fullscreen',
    onclick: () => document.documentElement.requestFullscreen().catch(() => {}) }, 'Full screen')];
}

function nextFrame() {
  return new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
}

async function askQuestion() {
  const size = pictureSize();
  const row = (ranks, side) => element('button', { className: 'pair', type: 'button', id: side,
    'aria-label': side === 'top' ? 'pair above' : 'pair below' },
  ...ranks.map((rank) => element('img', { src: pictures[rank].url, width: size, height: size,
    alt: '', draggable: false })));
  const { trial } = state;
  const top = row(trial.top, 'top');
  const bottom = row(trial.bottom, 'bottom');
  const done = element('div');
  done.style.width = `${100 * state.next / state.total}%`;
  show(element('p', { className: 'question' }, (trial.is_practice ? 'For practice: ' : '')
    + 'Which pair differs more, above \u2191 or below \u2193?'),
  element('div', { className: 'pairs' }, top, bottom),
  element('div', { className: 'bar', title: `${state.next} of ${state.total}` }, done));
  screenElement.dataset.trial = state.next;
  await Promise.all([...screenElement.querySelectorAll('img')].map((image) => image.decode()));
  await nextFrame();
  const shown = performance.now();
  const answer = await new Promise((resolve) => {
    const finish = (choice, key) => {
      const reaction = performance.now() - shown;
      if (reaction < IGNORE_MS) return;
      removeEventListener('keydown', onKey);
      resolve({ choice, key, reaction_ms: reaction });
    };
    const onKey = (event) => {
      if (event.repeat || event.ctrlKey || event.altKey || event.metaKey) return;
      const choice = { ArrowUp: 'top', ArrowDown: 'bottom' }[event.key];
      if (!choice) return;
      event.preventDefault();
      finish(choice, event.key);
    };
    addEventListener('keydown', onKey);
    // A click from the keyboard (Enter on a focused pair) has no detail: the arrows are the keys.
    const onClick = (choice) => (event) => { if (event.detail > 0) finish(choice, 'mouse'); };
    top.addEventListener('click', onClick('top'));
    bottom.addEventListener('click', onClick('bottom'));
    screenElement.dataset.ready = state.next;
  });
  (answer.choice === 'top' ? top : bottom).classList.add('chosen');
  const asked = state.next;
  state = await post('/api/answer', { trial: asked, stimulus_size_px: size, ...answer });
  show();
  await sleep(BLANK_MS);
}

async function run() {
  if (!token) {
    show(text('Picture study', paragraph('Please open the address that the program printed, with '
      + 'everything behind the # sign.')));
    return;
  }
  study = await (await ask('/api/study')).json();
  document.title = study.title;
  state = await enterCode();
  const isNew = state.next === 0;
  if (!state.has_consented) await consent();
  if (!state.is_done) {
    if (isNew) await instructions();
    await calibrate();
    await loadPictures();
    if (!isNew) {
      await page('Welcome back', 'Go on', paragraph(`You have answered ${state.next} of `
        + `${state.total} questions. The next one comes when you are ready.`), ...windowAdvice());
    } else {
      await page('Ready', 'Start', paragraph(`There are ${state.total} questions. The first one `
        + 'comes when you press the button.'), ...windowAdvice());
    }
  }
  let sinceBreak = 0;
  while (!state.is_done) {
    if (sinceBreak === study.break_every) {
      sinceBreak = 0;
      await page('A break', 'Go on', paragraph(`${state.next} of ${state.total} questions are `
        + 'done. Look into the distance for a while; go on when you like.'));
    }
    await calibrate();  // anew where the page was zoomed
    await askQuestion();
    ++sinceBreak;
  }
  sessionStorage.removeItem('participant');
  screenElement.dataset.finished = state.participant;
  show(text('Thank you', paragraph('All questions are answered and stored. You can close the '
    + 'page.')));
}

run().catch((error) => warn(error.message));
