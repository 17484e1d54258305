//! Values, expressions and functions.

use crate::cursor::Cursor;
use crate::fault::{ErrorKind, Expected, Fault, Math};
use crate::functions as f;
use crate::label::{Name, Target};
use crate::value::Value;

/// Values, operands and parameters that may be read within each other: a bracket is a value and an
/// operand, `#` a value and a parameter. Each takes stack.
const DEEPEST: u8 = 64;

/// The same in a line of a stream, for a microcontroller: 8 brackets, or fewer with operators between
/// them.
const SHALLOW: u8 = 17;

/// The distance below which EQ and NE take values for equal, as LinuxCNC does: 0.0001.
const EQUAL: Value = Value::constant(100_000_000_000_000);

/// The values that an expression can read.
pub(crate) trait Values {
    /// A numbered parameter.
    fn numbered(&self, number: u16) -> Result<Value, ErrorKind>;
    /// A named parameter.
    fn named(&self, name: &Name) -> Result<Value, ErrorKind>;
    /// Returns true if a parameter can be read.
    fn exists(&self, target: &Target) -> bool;
    /// Checks whether a program may set a parameter.
    fn may_set(&self, target: &Target) -> Result<(), ErrorKind>;
}

/// Reads the values of a line.
pub(crate) struct Reader<'t, 'v> {
    pub(crate) cursor: Cursor<'t>,
    values: &'v dyn Values,
    /// The number of levels by which values and operands may be nested deeper.
    left: u8,
}

impl<'t, 'v> Reader<'t, 'v> {
    pub(crate) fn new(cursor: Cursor<'t>, values: &'v dyn Values) -> Self {
        Self {
            cursor,
            values,
            left: DEEPEST,
        }
    }

    /// Reads with little stack.
    pub(crate) fn shallow(cursor: Cursor<'t>, values: &'v dyn Values) -> Self {
        Self {
            left: SHALLOW,
            ..Self::new(cursor, values)
        }
    }

    /// Goes a level deeper.
    fn deepen(&mut self) -> Result<(), Fault> {
        let left = self.left.checked_sub(1);
        self.left = left.ok_or_else(|| self.cursor.fault(ErrorKind::DeepBrackets))?;
        Ok(())
    }

    /// Reads a value: a number, a parameter, an expression in brackets or a function, with signs.
    pub(crate) fn value(&mut self) -> Result<Value, Fault> {
        self.deepen()?;
        let value = match self.cursor.peek() {
            Some(b'-') => {
                self.cursor.pass();
                self.value().map(Value::negative)
            }
            Some(b'+') => {
                self.cursor.pass();
                self.value()
            }
            Some(b'#') => self.parameter(),
            Some(b'[') => self.bracket(),
            Some(b'A'..=b'Z') => self.function(),
            Some(b'0'..=b'9' | b'.') => self.cursor.decimal(),
            _ => Err(self.cursor.expected(Expected::Value)),
        };
        self.left += 1;
        value
    }

    /// Reads `[expression]`.
    pub(crate) fn bracket(&mut self) -> Result<Value, Fault> {
        self.cursor.need(b'[', Expected::Bracket)?;
        let value = self.binary(1)?;
        self.cursor.need(b']', Expected::Operator)?;
        Ok(value)
    }

    /// Reads values between operators of this strength or a greater one.
    fn binary(&mut self, least: u8) -> Result<Value, Fault> {
        self.deepen()?;
        let mut left = self.value()?;
        loop {
            self.cursor.peek();
            let before = self.cursor;
            let operator = self.operator()?;
            let Some(operator) = operator.filter(|operator| operator.strength() >= least) else {
                self.cursor = before;
                self.left += 1;
                return Ok(left);
            };
            let right = self.binary(operator.strength() + 1)?;
            left = operator
                .apply(left, right)
                .map_err(|math| before.fault(math.into()))?;
        }
    }

    /// Reads an operator; `None` before `]`.
    fn operator(&mut self) -> Result<Option<Operator>, Fault> {
        let simple = match self.cursor.peek() {
            Some(b']') => return Ok(None),
            Some(b'+') => Operator::Plus,
            Some(b'-') => Operator::Minus,
            Some(b'/') => Operator::Over,
            Some(b'*') => Operator::Times,
            Some(b'A'..=b'Z') => {
                let found = self.named_operator();
                let expected = || self.cursor.expected(Expected::Operator);
                return found.map(Some).ok_or_else(expected);
            }
            _ => return Err(self.cursor.expected(Expected::Operator)),
        };
        self.cursor.pass();
        let is_power = simple == Operator::Times && self.cursor.take(b'*');
        Ok(Some(if is_power { Operator::Power } else { simple }))
    }

    /// Reads an operator of letters. Since blanks mean nothing, the letters of a function may follow
    /// at once.
    fn named_operator(&mut self) -> Option<Operator> {
        let mut ahead = self.cursor;
        let mut letters = Name::EMPTY;
        while letters.as_bytes().len() < 3 {
            letters.push(ahead.peek().filter(u8::is_ascii_uppercase)?);
            ahead.pass();
            if let Some(operator) = Operator::from_letters(letters.as_bytes()) {
                self.cursor = ahead;
                return Some(operator);
            }
        }
        None
    }

    /// Reads `#` and what parameter it means.
    pub(crate) fn target(&mut self) -> Result<Target, Fault> {
        self.cursor.need(b'#', Expected::Parameter)?;
        self.deepen()?;
        let target = self.named_or_numbered();
        self.left += 1;
        target
    }

    fn named_or_numbered(&mut self) -> Result<Target, Fault> {
        if self.cursor.take(b'<') {
            return self.cursor.name().map(Target::Name);
        }
        self.cursor.peek();
        let start = self.cursor;
        let number = self.value()?;
        let number = number
            .whole()
            .ok_or_else(|| start.fault(ErrorKind::NotWhole))?;
        let number = u16::try_from(number).map_err(|_| start.fault(ErrorKind::NoParameter))?;
        Ok(Target::Number(number))
    }

    #[inline(never)] // as for `apply`
    fn parameter(&mut self) -> Result<Value, Fault> {
        let start = self.cursor;
        let value = match self.target()? {
            Target::Number(number) => self.values.numbered(number),
            Target::Name(name) => self.values.named(&name),
        };
        value.map_err(|kind| start.fault(kind))
    }

    /// Reads `#parameter = value`.
    pub(crate) fn assignment(&mut self) -> Result<(Target, Value), Fault> {
        let start = self.cursor;
        let target = self.target()?;
        self.values
            .may_set(&target)
            .map_err(|kind| start.fault(kind))?;
        self.cursor.need(b'=', Expected::Equals)?;
        Ok((target, self.value()?))
    }

    #[inline(never)] // as for `apply`
    fn function(&mut self) -> Result<Value, Fault> {
        let start = self.cursor;
        let name = self.cursor.letters();
        if name.as_bytes() == b"EXISTS" {
            self.cursor.need(b'[', Expected::Bracket)?;
            let target = self.target()?;
            self.cursor.need(b']', Expected::Operator)?;
            return Ok(Value::from_bool(self.values.exists(&target)));
        }
        if !FUNCTIONS.contains(&name.as_bytes()) {
            return Err(start.fault(ErrorKind::UnknownFunction));
        }
        let argument = self.bracket()?;
        let result = if name.as_bytes() == b"ATAN" {
            self.cursor.need(b'/', Expected::Slash)?;
            f::atan(argument, self.bracket()?)
        } else {
            of_one(name.as_bytes(), argument)
        };
        result.map_err(|math| start.fault(math.into()))
    }
}

/// The functions of one number, and ATAN.
const FUNCTIONS: [&[u8]; 13] = [
    b"ABS", b"ACOS", b"ASIN", b"ATAN", b"COS", b"EXP", b"FIX", b"FUP", b"LN", b"ROUND", b"SIN",
    b"SQRT", b"TAN",
];

#[inline(never)] // as for `apply`
fn of_one(name: &[u8], value: Value) -> Result<Value, Math> {
    match name {
        b"ABS" => Ok(value.abs()),
        b"ACOS" => f::acos(value),
        b"ASIN" => f::asin(value),
        b"COS" => f::cos(value),
        b"EXP" => f::exp(value),
        b"FIX" => value.floor(),
        b"FUP" => value.negative().floor().map(Value::negative),
        b"LN" => f::ln(value),
        b"ROUND" => Value::new(value.seen().rounded(0).count()),
        b"SIN" => f::sin(value),
        b"SQRT" => f::sqrt(value),
        _ => f::tan(value),
    }
}

/// An operator between two values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Operator {
    Power,
    Times,
    Over,
    Modulo,
    Plus,
    Minus,
    Equal,
    Unequal,
    Above,
    NotBelow,
    Below,
    NotAbove,
    And,
    Or,
    Either,
}

impl Operator {
    fn from_letters(letters: &[u8]) -> Option<Self> {
        Some(match letters {
            b"MOD" => Self::Modulo,
            b"EQ" => Self::Equal,
            b"NE" => Self::Unequal,
            b"GT" => Self::Above,
            b"GE" => Self::NotBelow,
            b"LT" => Self::Below,
            b"LE" => Self::NotAbove,
            b"AND" => Self::And,
            b"OR" => Self::Or,
            b"XOR" => Self::Either,
            _ => return None,
        })
    }

    /// Greater for operators that are applied earlier.
    const fn strength(self) -> u8 {
        match self {
            Self::Power => 5,
            Self::Times | Self::Over | Self::Modulo => 4,
            Self::Plus | Self::Minus => 3,
            Self::Equal
            | Self::Unequal
            | Self::Above
            | Self::NotBelow
            | Self::Below
            | Self::NotAbove => 2,
            Self::And | Self::Or | Self::Either => 1,
        }
    }

    #[inline(never)] // what it calculates with is not on the stack of each operand
    fn apply(self, left: Value, right: Value) -> Result<Value, Math> {
        let (is, and) = (!left.is_zero(), !right.is_zero());
        let (seen, other) = (left.seen(), right.seen());
        let is_true = match self {
            Self::Power => return f::power(left, right),
            Self::Times => return left.times(right),
            Self::Over => return left.over(right),
            Self::Modulo => return left.modulo(right),
            Self::Plus => return left.plus(right),
            Self::Minus => return left.minus(right),
            Self::Equal => left.minus(right)?.abs() < EQUAL,
            Self::Unequal => left.minus(right)?.abs() >= EQUAL,
            Self::Above => seen > other,
            Self::NotBelow => seen >= other,
            Self::Below => seen < other,
            Self::NotAbove => seen <= other,
            Self::And => is && and,
            Self::Or => is || and,
            Self::Either => is != and,
        };
        Ok(Value::from_bool(is_true))
    }
}
