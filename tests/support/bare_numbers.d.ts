declare const bareNumbers: (words: object) => string[];
export default bareNumbers;
