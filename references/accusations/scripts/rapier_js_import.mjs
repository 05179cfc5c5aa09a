// Node cannot import the package, because it declares as a module what is not one.
let answer = 'is imported';
try {
  await import('@dimforge/rapier3d-compat');
} catch (error) {
  answer = `raises ${error.name}: ${error.message.split('\n')[0]}`;
}
console.log(`the package ${answer}: ${answer === 'is imported' ? 'right' : 'wrong'}`);
